"""Units and thresholds from values, where a name does not tell them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kemba.quantity import convert
from kemba.trajectory import Array

# Per SI unit: (unit, largest magnitude of a typical value in it). The first that fits is taken.
# Robots of 0.1 to 2 m, strokes below 0.3 m, pressures of 0.5 to 12 bar, 50 Hz to 10 kHz.
LENGTH = (("m", 3.0), ("cm", 60.0), ("mm", 3e3), ("um", 3e6))
EXTENSION = (("m", 0.5), ("mm", 500.0), ("um", 5e5))
LENGTHS = ("m", "cm", "mm", "um")
ANGLE = (("rad", 6.6), ("deg", 400.0), ("mrad", 7e3))
PRESSURE = (("MPa", 0.05), ("bar", 20.0), ("kPa", 2e3), ("mbar", 2e4), ("Pa", 2e6))
STEP = (("s", 0.05), ("ms", 50.0), ("us", 5e4), ("ns", 5e7))
ABSOLUTE = 0.8e5  # Pa; a pressure that falls below it is counted from the atmosphere
ATMOSPHERE = "1.01325 bar"


def guessed_unit(header: str, values: Array, stroke: float | None = None) -> str | None:
    """The unit of a column by its values, or those of all that are `alike`; None where it is ours
    or cannot be told. That of a piston makes most of them the `stroke` [m]."""
    unit = header[header.index("[") + 1 : -1]
    table = {"m": EXTENSION if "piston/" in header else LENGTH, "rad": ANGLE, "Pa": PRESSURE}
    size = float(np.nanmax(np.abs(values), initial=0.0))
    if "piston/x" in header and stroke and size:
        far = {name: abs(math.log10(convert(size, name, "m") / stroke)) for name in LENGTHS}
        best = min(far, key=far.__getitem__)
        return None if best == "m" else best
    for name, largest in table.get(unit, ()):
        if size <= largest:
            return None if name == unit else name
    return None


def alike(header: str) -> str:
    """What columns have in common that one log gives in one unit: all angles, all pistons. Force
    sensors are told apart: each has its own amplifier."""
    unit = header[header.index("[") + 1 : -1]
    return header if unit == "N" else f"piston {unit}" if "piston/" in header else unit


def time_unit(values: Array) -> str:
    """The unit of a time column (n,) by the step between its rows."""
    steps = np.diff(values)
    step = float(np.median(steps[steps > 0])) if np.any(steps > 0) else 0.0
    return next((unit for unit, largest in STEP if step <= largest), "ns")


def in_ours(values: Array, unit: str | None, ours: str) -> Array:
    """Values (n,) in our unit."""
    return convert(values, unit or ours, ours)


def gauge(values: Array, unit: str | None) -> dict[str, Any]:
    """The offset of a pressure (n,) that is zero at the atmosphere."""
    low = float(np.nanmin(in_ours(values, unit, "Pa"), initial=np.inf))
    return {"offset": ATMOSPHERE} if low < ABSOLUTE else {}


def valve_level(values: Array) -> float | None:
    """Half way between the two levels of a valve (n,); None where they are 0 and 1."""
    finite = values[np.isfinite(values)]
    if not len(finite) or set(np.unique(finite)) <= {0.0, 1.0}:
        return None
    return float(f"{(finite.min() + finite.max()) / 2:.3g}")


def two_levels(values: Array) -> bool:
    """Whether nearly all values (n,) lie at the ends of their range, as those of a valve do."""
    finite = values[np.isfinite(values)]
    if len(finite) < 2 or np.ptp(finite) == 0:
        return len(finite) > 0
    share = (finite - finite.min()) / np.ptp(finite)
    return bool(np.mean((share < 0.1) | (share > 0.9)) > 0.98)
