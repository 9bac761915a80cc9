"""Where a gap closes within a step."""

from __future__ import annotations

import numpy as np

from kemba.plant.kernel.jit import kernel

BEYOND = 1.5  # steps; how far a root may lie behind the end of the step


@kernel
def first_root(gap: float, rate: float, end: float, rise: float) -> float:
    """First zero in (0, `BEYOND`], in steps, of the cubic through a gap and its rate per step at
    both ends of a step; `rise` is how much the gap grows.

    Where the cubic has none the secant answers.
    """
    c1, c2, c3 = rate, 3.0 * rise - 2.0 * rate - end, rate + end - 2.0 * rise
    borders = np.array([np.inf, np.inf, BEYOND])  # between its extrema the cubic is monotonous
    discriminant = c2 * c2 - 3.0 * c3 * c1
    if discriminant > 0.0:
        far = -(c2 + np.copysign(np.sqrt(discriminant), c2))
        borders[0], borders[1] = c1 / far, far / (3.0 * c3)
    if borders[0] > borders[1]:
        borders[0], borders[1] = borders[1], borders[0]
    low, value = 0.0, gap
    for border in borders:
        if not 0.0 < border <= BEYOND:
            continue
        other = gap + border * (c1 + border * (c2 + border * c3))
        if (other > 0.0) != (value > 0.0):
            return _bisect(gap, c1, c2, c3, low, border)
        low, value = border, other
    return -gap / rise


@kernel
def _bisect(c0: float, c1: float, c2: float, c3: float, low: float, high: float) -> float:
    """The zero of a monotonous cubic between `low` and `high`, by Newton's method held between."""
    upwards = c0 + high * (c1 + high * (c2 + high * c3)) > 0.0
    x = 0.5 * (low + high)
    for _ in range(60):
        value = c0 + x * (c1 + x * (c2 + x * c3))
        if (value > 0.0) == upwards:
            high = x
        else:
            low = x
        slope = c1 + x * (2.0 * c2 + x * 3.0 * c3)
        new = x - value / slope if slope != 0.0 else low
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - x) <= 1e-15:
            return new
        x = new
    return x
