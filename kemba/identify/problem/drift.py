"""A slow drift of a sensor: cosines with the variances of a first-order lag.

A drift of one sigma moves a reading no further than its noise, but for a second instead of a row,
and so it looks like a small force, or like a faulty sensor.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kemba.identify.problem.sensor_noise import ColourSettings
from kemba.identify.problem.types import Array


class DriftColumnSettings:
    """Drifts that any sensor may have."""

    waves = 8  # cosines of a run: 92 to 99 % of the variance of a lag of 1 s in 0.5 to 4 s
    size = 1.0  # sigma of a drift, in stated sigmas: as the noise


def drift_waves(time: Array) -> tuple[Array, Array]:
    """Cosines (n, d) of a run's rows at `time` (n,) [s], and the standard deviations (d,) that make
    a drift of them."""
    length = max(float(np.ptp(time)), 1e-9)
    order = np.arange(float(DriftColumnSettings.waves))
    return np.cos(np.pi * np.outer((time - time[0]) / length, order)), _sigmas(order, length)


def _sigmas(order: Array, length: float) -> Array:
    """Standard deviations (d,) of cosines that make a lag of unit variance, over `length` [s]."""
    memory = max(ColourSettings.drifts)
    variance = np.where(order == 0, 0.5, 1.0) / (1.0 + (np.pi * order * memory / length) ** 2)
    mean = variance @ np.where(order == 0, 1.0, 0.5)
    return np.asarray(DriftColumnSettings.size * np.sqrt(variance / mean))


@dataclass(frozen=True)
class DriftNoise:
    """A drift whose size is not known, in white rows: they have the covariance I + UU'.

    `shape` (n, d): orthonormal; `variance` (d,): of the drift along it.
    """

    shape: Array
    variance: Array

    @classmethod
    def of(cls, columns: Array) -> DriftNoise:
        """Of columns U (n, d), one per cosine of unit sigma, whitened."""
        shape, size, _ = np.linalg.svd(columns, full_matrices=False)
        return cls(shape, size**2)

    def out_of(self, rows: Array) -> Array:
        """(I + UU')^-1/2 rows, of (n,) or (n, k): white again."""
        lost = 1.0 - 1.0 / np.sqrt(1.0 + self.variance)
        return np.asarray(rows - (self.shape * lost) @ (self.shape.T @ rows))

    @property
    def log_density(self) -> float:
        """What the drift adds to the log density [nats] of rows that are zero."""
        return -0.5 * float(np.sum(np.log1p(self.variance)))
