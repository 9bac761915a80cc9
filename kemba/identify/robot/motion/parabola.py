"""Rates of noisy columns, from parabolas through the neighbours of every row.

They are those of `scipy.signal.savgol_filter`, whose import takes half a second of every
comparison.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.ndimage import correlate1d

Array = np.ndarray[Any, np.dtype[np.float64]]


def rate(values: Array, rows: int, step: float, order: int = 1) -> Array:
    """The first (`order` 1) or second derivative of columns (n, ...) with a row every `step`.

    `rows`: the width of a parabola, odd and at most n. The first and the last half of a width
    follow the first and the last parabola.
    """
    half = rows // 2
    place = np.arange(-half, half + 1.0)
    powers = np.vander(place, 3, increasing=True)
    fit = np.linalg.pinv(powers)  # values of a window -> constant, slope, half the curvature
    weights = order * fit[order] / step**order
    found = np.asarray(correlate1d(np.asarray(values, dtype=float), weights, axis=0))
    for window, ends in (
        (values[:rows], slice(0, half)),
        (values[len(values) - rows :], slice(len(values) - half, None)),
    ):
        _, slope, bend = np.tensordot(fit, window, axes=1)
        where = place[:half] if ends.start == 0 else place[rows - half :]
        shape = (-1, *(1,) * (np.ndim(values) - 1))
        tangent = slope + 2.0 * bend * where.reshape(shape)
        found[ends] = tangent / step if order == 1 else 2.0 * bend / step**2
    return found
