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
    "`presliding` is Coulomb friction that needs some travel to turn round; what it and "
    "`axis_friction` give together is to be compared with the published F_c.",
    "`sensor_delay:axis/q` is the clock of the position beside that of the force.",
    "Without the rule that an effect must explain a tenth of what the answer leaves, the friction "
    "was split between two laws of it (14 and 8 N), with a lag of 2 ms beside them. The rule was "
    "made for these data.",
)
