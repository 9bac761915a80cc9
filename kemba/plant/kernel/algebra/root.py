"""Where a gap closes within a step."""

from __future__ import annotations

from math import copysign, sqrt

from kemba.plant.kernel.jit import part
from kemba.plant.kernel.settings import ContactEvents

BEYOND = ContactEvents.current().beyond


@part
def first_root(gap: float, rate: float, end: float, rise: float) -> float:
    """First zero in (0, `BEYOND`], in steps, of the cubic through a gap and its rate per step at
    both ends of a step; `rise` is how much the gap grows.

    Where the cubic has none the secant answers.
    """
    c1, c2, c3 = rate, 3.0 * rise - 2.0 * rate - end, rate + end - 2.0 * rise
    early, late = BEYOND, BEYOND  # the extrema: between them the cubic is monotonous
    discriminant = c2 * c2 - 3.0 * c3 * c1
    if discriminant > 0.0:
        far = -(c2 + copysign(sqrt(discriminant), c2))
        early, late = c1 / far, far / (3.0 * c3)
    if early > late:
        early, late = late, early
    low, above = 0.0, gap > 0.0
    for border in (early, late, BEYOND):
        if 0.0 < border <= BEYOND:
            if (gap + border * (c1 + border * (c2 + border * c3)) > 0.0) != above:
                return _between(gap, c1, c2, c3, low, border)
            low = border
    return -gap / rise


@part
def _between(c0: float, c1: float, c2: float, c3: float, low: float, high: float) -> float:
    """The zero of a monotonous cubic from `low` to `high`, by Newton's method held between."""
    upwards = c0 + high * (c1 + high * (c2 + high * c3)) > 0.0
    x = 0.5 * (low + high)
    for _ in range(60):
        value = c0 + x * (c1 + x * (c2 + x * c3))
        if (value > 0.0) == upwards:
            high = x
        else:
            low = x
        slope = c1 + x * (2.0 * c2 + x * 3.0 * c3)
        new = x - value / slope
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - x) <= 1e-15:
            break
        x = new
    return x
