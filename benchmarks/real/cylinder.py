"""Two seals of a pneumatic cylinder: which friction, how large."""

from pathlib import Path

from benchmarks.real import data
from benchmarks.real.say import answered, fitted, listed

# half the difference of force between the two directions at one x, fitted by hand
HALVES = {
    "O-ring": "3.4 N and 0.0133 of p A",
    "KDN": "5.3 N and 0.004 of p A",
}


def section(scratch: Path, download: bool) -> list[str]:
    """Lines of the page about the cylinder."""
    lines = ["## A pneumatic cylinder with two seals", ""]
    lines += [
        "Bore 25 mm, one chamber at 1, 3, 5 and 7 bar, driven to and fro at 10 mm/s, 100 rows a",
        "second with gaps of up to 2.7 s (Zillen et al., HardwareX 2024, CC0). Model:",
        "`configs/models/cylinder_rig.yaml`, pressure times area alone. Expected is half the",
        "difference of force between the two directions, read off by hand.",
        "",
    ]
    for seal, bars in data.SEALS.items():
        logs = []
        for bar in bars:
            logs.append(scratch / f"{seal}_{bar}bar.csv")
            data.cylinder(seal, bar, download).write(logs[-1])
        lines += [f"### {seal}: {HALVES[seal]} expected", ""]
        lines += answered(logs, "cylinder_rig", scratch)
        effects = ["seal_friction", "pressure_friction"]
        lines += fitted(logs, "cylinder_rig", effects, scratch)
    return [*lines, *listed(NOTES), ""]


NOTES = (
    "Intervals are those of one mounting. The data's authors found +-12 % between mountings of one "
    "seal; no log of one mounting can show that.",
    "`measured_chambers.gain` is the bore's area, or the scale of the force sensor, over the "
    "nominal one: both are the same in these logs.",
    "Size of a usual friction (`SEAL`): it was halved, to 5 N at 25 mm, after a "
    "first look at these data. With 10 N the constant part of the O-ring was found as well, but "
    "left out as too small to matter.",
    "Friction within 0.5 mm after a turn is taken to be in doubt, as seals stretch. Without that "
    "the answers named delays of sensors of 10 to 25 ms.",
)
