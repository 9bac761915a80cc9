"""Polynomials fitted around each row of a noisy signal (Savitzky and Golay, 1964).

What `scipy.signal.savgol_filter` gives; its import takes half a second of every comparison.
"""

from functools import lru_cache

import numpy as np
from scipy.ndimage import correlate1d

from kemba.identify.problem.problem import Array


def local_fit(values: Array, width: int, step: float, degree: int, derivative: int = 0) -> Array:
    """A derivative (n, ...) of the polynomial through the 2 width + 1 rows around each row of
    values (n, ...), which are a `step` apart.

    At the ends the window stays inside and is read off its centre.
    """
    n, weigh = len(values), weights(width, degree, derivative) / step**derivative
    found = correlate1d(np.asarray(values, dtype=float), weigh[width], axis=0)
    found[:width] = np.tensordot(weigh[:width], values[: 2 * width + 1], 1)
    found[n - width :] = np.tensordot(weigh[width + 1 :], values[n - 2 * width - 1 :], 1)
    return np.asarray(found)


@lru_cache(maxsize=256)
def weights(width: int, degree: int, derivative: int) -> Array:
    """Weights (2 width + 1, 2 width + 1) of the rows of a window, for the derivative at each of its
    places, where rows are 1 apart."""
    s, powers = np.arange(-width, width + 1) / width, np.arange(degree + 1)
    basis = s[:, None] ** powers
    factor = np.ones(degree + 1)
    for i in range(derivative):
        factor *= (powers - i) / width
    at = factor * s[:, None] ** np.maximum(powers - derivative, 0)
    return np.asarray(at @ np.linalg.pinv(basis))
