"""The EMPS drive: from inertia alone to friction that differs by direction."""

from pathlib import Path

from benchmarks.real import data
from benchmarks.real.say import answered, fitted, listed


def section(scratch: Path, download: bool) -> list[str]:
    """Lines of the page about the drive."""
    log = scratch / "emps.csv"
    data.emps(download).write(log)
    lines = ["## EMPS: a linear drive with a ball screw", ""]
    lines += [
        "24 841 rows at 1 kHz. Model: `configs/models/drive_rig.yaml`, 95 kg without any friction.",
        "Published by least squares: M = 95.11 kg, F_v = 203.5 N.s/m, F_c = 20.39 N, offset",
        "-3.165 N (of the motor's force: F_0 = +3.165 N in our convention).",
        "",
    ]
    lines += answered([log], "drive_rig", scratch)
    published = ["axis_friction", "axis_damping", "axis_offset"]
    lines += ["The published model, fitted:", "", *fitted([log], "drive_rig", published, scratch)]
    lines += ["With a friction that differs by direction:", ""]
    lines += fitted([log], "drive_rig", [*published, "axis_direction"], scratch)
    return [*lines, *listed(NOTES), ""]


NOTES = (
    "While an answer could name two laws of one friction, it was 18.3 N of `axis_friction` and "
    "3.4 N of `presliding`, with a sensor that is 0.7 ms late beside them.",
)
