"""Units that nothing tells: by the sizes that are usual, else a question."""

from collections.abc import Collection, Mapping

import numpy as np

from kemba.logs.draft.words import Names
from kemba.quantity import convert
from kemba.trajectory import Array

# Usual size of the largest reading, and from where to where one may lie [SI]; from 0 where a still
# machine may have any small one, so that the size alone tells little. Of robots of 0.1 to 2 m.
SIZES = {
    "body/x": (0.3, 0.0, 20.0),
    "body/z": (0.3, 0.05, 3.0),
    "body/pitch": (0.2, 0.0, 1.6),
    "body/vx": (1.0, 0.0, 20.0),
    "body/vz": (2.0, 0.3, 15.0),
    "hip/q": (1.0, 0.1, 6.6),
    "hip/tau": (10.0, 0.5, 150.0),
    "piston/x": (0.1, 3e-3, 0.5),
    "piston/F": (100.0, 0.5, 2e4),
    "piston/v": (1.0, 0.05, 8.0),
    "P": (7e5, 1.5e5, 2e6),
    "T": (295.0, 200.0, 450.0),
    "axis/q [m]": (0.3, 0.01, 3.0),
    "axis/q [rad]": (1.0, 0.0, 6.6),
    "axis/tau [N.m]": (5.0, 0.02, 500.0),
    "axis/tau [N]": (100.0, 0.5, 2e4),
}
UNITS = {
    "m": ("m", "cm", "mm", "um", "in"),
    "rad": ("rad", "deg", "mrad"),
    "m.s-1": ("m.s-1", "cm.s-1", "mm.s-1"),
    "N": ("N", "kN"),
    "N.m": ("N.m", "mN.m"),
    "Pa": ("Pa", "mbar", "kPa", "psi", "bar", "MPa"),
    "K": ("K", "degC", "degF"),
}
ANY = (1.0, 0.0, np.inf)  # SI, whatever its size
STROKES = (0.03, 1.25)  # shares of a known stroke between which the largest reading may lie
Size = tuple[float, float, float]


def guessed_units(
    names: Names, pairs: Mapping[str, str], values: Mapping[str, Array], stroke: float | None
) -> tuple[dict[str, str], list[str]]:
    """The units of our headers whose foreign columns (`pairs`, (n,) in `values`) have none, and
    what is to be asked about them; `stroke` [m].

    Columns of one kind (all hips) are told by their size together. Those whose size tells nothing
    have our unit, or the one that was told for others without a unit; where another unit that the
    log uses would do as well, this is asked.
    """
    kinds: dict[tuple[str, str], list[str]] = {}
    stated: dict[str, set[str]] = {}
    found: dict[str, str] = {}
    for header, name in pairs.items():
        unit = names.unit(name)
        if unit is None and names.angles and header.endswith("[rad]"):
            unit = found[header] = names.angles
        if unit is not None:
            stated.setdefault(_sensors(header), set()).add(unit)
        elif not header.endswith("[1]"):
            kinds.setdefault((_kind(header), _sensors(header)), []).append(header)
    told: dict[str, str] = {}
    asked: list[str] = []
    for (kind, sensors), own in sorted(kinds.items(), key=lambda k: not _size(k[0][0], stroke)[1]):
        usual, ours = _size(kind, stroke), own[0][own[0].index("[") + 1 : -1]
        sizes = [float(np.nanmax(np.abs(values[pairs[h]]), initial=0.0)) for h in own]
        others = sorted(u for u in stated.get(sensors, ()) if convert(1.0, u, ours) != 1.0)
        if usual[1] > 0.0:
            each = [_fitting(size, ours, [*UNITS[ours], *others], usual) for size in sizes]
            fitting = each[int(np.argmax(sizes))]
            told[sensors] = unit = fitting[0] if fitting else ours
            fine = len(fitting) == 1 if fitting else max(sizes) < usual[1]
            fine &= all(unit in fit or not fit for fit in each)
        else:
            known = [told.get(sensors, ours), ours, *others]
            fitting = [u for u in dict.fromkeys(known) if _fits(max(sizes), u, ours, usual)]
            fine = len(fitting) == 1 and fitting[0] in known[:2]
            fitting = fitting or _fitting(max(sizes), ours, UNITS.get(ours, (ours,)), usual)
            unit = fitting[0] if fitting else ours
        found |= dict.fromkeys(own, unit)
        if any(sizes) and not fine:
            reach = ", ".join(
                f"'{pairs[h]}', at most {s:.3g}" for h, s in zip(own, sizes, strict=True)
            )
            more = " or ".join(fitting[1:3]) or "something else"
            turns = ", or several turns" if ours == "rad" and max(sizes) > usual[2] else ""
            asked.append(
                f"{', '.join(own)}: no unit is told for {reach}: taken as {unit}, "
                f"but may be {more}{turns}"
            )
    return found, asked


def _sensors(header: str) -> str:
    """What columns have in common that one program logs in one unit: all angles, all pistons."""
    unit = header[header.index("[") :]
    return f"piston {unit}" if "piston/" in header else unit


def _kind(header: str) -> str:
    """What columns have in common whose sizes are alike."""
    name = header.split(" [")[0]
    return next((k for k in SIZES if header == k or f"/{name}".endswith(f"/{k}")), name)


def _size(kind: str, stroke: float | None) -> Size:
    if kind == "piston/x" and stroke:
        return (stroke, STROKES[0] * stroke, STROKES[1] * stroke)
    return SIZES.get(kind, ANY)


def _fits(size: float, unit: str, ours: str, usual: Size) -> bool:
    return usual[1] <= convert(size, unit, ours) <= usual[2]


def _fitting(size: float, ours: str, units: Collection[str], usual: Size) -> list[str]:
    """The units in which a size lies where it may, that of the most usual one first."""
    fit = [u for u in dict.fromkeys(units) if _fits(size, u, ours, usual)]
    return sorted(fit, key=lambda u: abs(np.log(convert(size, u, ours) / usual[0])))
