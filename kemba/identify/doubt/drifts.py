"""Slow drifts of sensors as columns: cosines with the variances of a first-order lag.

A drift of one sigma moves a reading no further than its noise, but for a second instead of a row,
and so it looks like a small force. A formula must explain more than that.
"""

from __future__ import annotations

import numpy as np

from kemba.identify.problem.problem import Array, Problem
from kemba.identify.problem.sensor_noise import ColourSettings
from kemba.settings import Settings, setting


class DriftColumnSettings(Settings):
    """Drifts that any sensor may have."""

    waves: int = setting(
        8,
        "1",
        "cosines of a run",
        "derived: 94 to 99 % of the variance of a lag of 1 s in 0.5 to 3 s",
    )
    size: float = setting(
        1.0, "1", "sigma of a drift, in stated sigmas", "convention: as the noise"
    )


def drift_columns(problem: Problem) -> tuple[Array, Array]:
    """Columns (n, d) of slow drifts of every channel in every run, whitened, and the prior width
    (d,) of each. None where the motion depends on the model: there drifts are noise of a filter.
    """
    rows, columns, widths = problem.rows(), [], []
    if problem.moves:
        return np.empty((len(rows), 0)), np.empty(0)
    for run, channel in np.unique(np.stack([rows.run, rows.channel]), axis=1).T:
        own = (rows.run == run) & (rows.channel == channel)
        time = rows.time[own]
        length = max(float(np.ptp(time)), 1e-9)
        waves = np.zeros((len(rows), DriftColumnSettings.current().waves))
        order = np.arange(float(waves.shape[1]))
        waves[own] = np.cos(np.pi * np.outer((time - time[0]) / length, order))
        columns.append(waves)
        widths.append(_sigmas(order, length))
    return problem.whiten(np.hstack(columns)), np.concatenate(widths)


def _sigmas(order: Array, length: float) -> Array:
    """Standard deviations (d,) of cosines that make a lag of unit variance, over `length` [s]."""
    memory = max(ColourSettings.current().drifts)
    variance = np.where(order == 0, 0.5, 1.0) / (1.0 + (np.pi * order * memory / length) ** 2)
    mean = variance @ np.where(order == 0, 1.0, 0.5)
    return np.asarray(DriftColumnSettings.current().size * np.sqrt(variance / mean))
