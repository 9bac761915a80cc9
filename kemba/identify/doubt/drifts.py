"""Drifts of all sensors as columns: a formula must explain more than they do."""

from __future__ import annotations

import numpy as np

from kemba.identify.problem.drift import drift_waves
from kemba.identify.problem.problem import Array, Problem


def drift_columns(problem: Problem) -> tuple[Array, Array]:
    """Columns (n, d) of slow drifts of every channel in every run, whitened, and the prior width
    (d,) of each. None where the motion depends on the model: there drifts are noise of a filter.
    """
    rows, columns, widths = problem.rows(), [], []
    if problem.moves:
        return np.empty((len(rows), 0)), np.empty(0)
    for run, channel in np.unique(np.stack([rows.run, rows.channel]), axis=1).T:
        own = (rows.run == run) & (rows.channel == channel)
        waves, sigmas = drift_waves(rows.time[own])
        columns.append(np.zeros((len(rows), len(sigmas))))
        columns[-1][own] = waves
        widths.append(sigmas)
    return problem.whiten(np.hstack(columns)), np.concatenate(widths)
