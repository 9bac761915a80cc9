"""Tails of distributions, and the control of false discoveries, by `scipy.special` alone.

They are those of `scipy.stats`, whose import takes half a second of every comparison.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import chdtrc, ndtr, ndtri

Array = np.ndarray


def chi2_above(value: float, degrees: float) -> float:
    """The chance that chi-squared with these degrees of freedom is larger."""
    return float(chdtrc(degrees, value))


def normal_above(value: Array) -> Array:
    """The chances (n,) that a standard normal is larger than `value` (n,)."""
    return np.asarray(ndtr(-np.asarray(value)))


def normal_at(chance: float) -> float:
    """The value that a standard normal exceeds with this chance."""
    return float(-ndtri(chance))


def false_discoveries(chances: Sequence[float] | Array) -> Array:
    """Adjusted chances (n,): the expected share of false ones among those found up to each.

    Source: Benjamini and Hochberg 1995.
    """
    p = np.asarray(chances, dtype=float)
    order = np.argsort(p)
    raised = p[order] * (len(p) / np.arange(1, len(p) + 1))
    least = np.minimum.accumulate(raised[::-1])[::-1]
    found = np.empty(len(p))
    found[order] = np.clip(least, 0.0, 1.0)
    return found
