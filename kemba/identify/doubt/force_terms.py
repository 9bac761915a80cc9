"""Force terms beyond the catalogue that the rods of bench and robot share."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kemba.identify.problem.types import Array


class ForceTermSettings:
    """Constants of the force terms that are tried on rods."""

    ranges = (0.003, 0.005, 0.008, 0.013, 0.02)  # reach of a force at an end of the stroke [m]


def end_terms(x: Array, stroke: float) -> Iterator[tuple[str, Array]]:
    """(formula, force per unit coefficient (...)) of forces near the ends of the stroke.

    `x` (...) [m]: position of the piston; `stroke` [m].
    """
    for d in ForceTermSettings.ranges:
        yield f"exp(-(x/{d:g})**2)", np.exp(-((x / d) ** 2))
        yield f"exp(-(({stroke:g} - x)/{d:g})**2)", np.exp(-(((stroke - x) / d) ** 2))


def dahl(x: Array, travel: float) -> Array:
    """Hysteresis (n,): z' = (v - abs(v) z)/travel along the path x (n,) [m].

    Dahl's model of friction: the force changes its sign over a `travel` [m].
    """
    z, out = 0.0, np.empty(len(x))
    out[0] = z
    for i, step in enumerate(np.diff(x), start=1):
        target = 1.0 if step > 0 else -1.0
        z = target + (z - target) * np.exp(-abs(step) / travel)
        out[i] = z
    return out
