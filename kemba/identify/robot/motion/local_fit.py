"""Derivatives of noisy signals by quadratics fitted around each row (Savitzky and Golay, 1964).

As `scipy.signal.savgol_filter` has them, whose import takes half a second of every comparison.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.ndimage import correlate1d

Array = np.ndarray[Any, np.dtype[np.float64]]


def derivative(values: Array, half: int, order: int, dt: float) -> Array:
    """The first or second derivative (n, ...) of values (n, ...), by the quadratic through the rows
    up to `half` before and after each; near the ends by that through the last ones.

    `order`: 1 or 2; `dt` [s] between rows, of which there are 2 half + 1 at least.
    """
    window = np.arange(-half, half + 1)
    slope = {1: lambda x: [0.0 * x, x**0, 2.0 * x], 2: lambda x: [0.0 * x, 0.0 * x, 2.0 * x**0]}
    at = np.stack(slope[order](window.astype(float)), axis=1)  # of 1, x, x^2 at each place
    weights = at @ np.linalg.pinv(np.vander(window, 3, increasing=True)) / dt**order
    found = correlate1d(np.asarray(values, dtype=float), weights[half], axis=0)
    found[:half] = np.tensordot(weights[:half], values[: 2 * half + 1], 1)
    found[len(values) - half :] = np.tensordot(weights[half + 1 :], values[-2 * half - 1 :], 1)
    return np.asarray(found)
