"""Error that repeats itself with motion and valves: how much of it an answer leaves."""

from __future__ import annotations

import numpy as np

from kemba.identify.evidence.search import Search
from kemba.identify.evidence.spike_slab import NULL, Hypothesis
from kemba.identify.problem.problem import Array, Labels


class UnexplainedSettings:
    """When error that repeats itself tells that something is missing."""

    structure = 1.0  # repeatable mean square, in noise units, that an imperfect model may leave
    left = 0.1  # the same as a share of what the answer explains
    clip = 30.0  # residuals are clipped at so many sigmas
    ridges = (1e-4, 1e-2, 1.0)  # penalties of the regression that are tried
    folds = 5  # blocks of time that are left out in turn: five


def structured(search: Search, hypothesis: Hypothesis) -> tuple[float, float]:
    """Mean square of the residual in noise units, and the part of it that repeats itself.

    A regression on everything that a force could depend on is learnt on some blocks of time. What
    it predicts in the other blocks is structure: noise cannot be predicted, however coloured.
    """
    settings = UnexplainedSettings
    left_over = search.problem.leftover(search.points[hypothesis].fit.theta)
    if left_over is None:
        return 1.0, 0.0
    r = np.clip(left_over.residual, -settings.clip, settings.clip)
    columns = left_over.features
    columns = columns / np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-9)
    folds = _folds(left_over.run)
    power = float(np.mean(r**2))
    left = min(
        float(np.mean((r - _predicted_folds(r, columns, folds, k)) ** 2)) for k in settings.ridges
    )
    return power, max(power - left, 0.0)


def _predicted_folds(r: Array, columns: Array, folds: Labels, ridge: float) -> Array:
    """Residual (n,) that a ridge regression on the other folds predicts for each fold.

    `columns` (n, m): regressors; `folds` (n,): fold of each row.
    """
    predicted = np.zeros(len(r))
    for fold in np.unique(folds):
        out = folds == fold
        a, b = columns[~out], r[~out]
        h = a.T @ a + ridge * len(a) * np.eye(a.shape[1])
        predicted[out] = columns[out] @ np.linalg.solve(h, a.T @ b)
    return predicted


def _folds(run: Labels) -> Labels:
    """Which fold each row (n,) belongs to: runs are cut into blocks of time, dealt out in turn."""
    folds = UnexplainedSettings.folds
    labels = np.zeros(len(run), dtype=int)
    for i in np.unique(run):
        own = np.flatnonzero(run == i)
        labels[own] = np.arange(len(own)) * 2 * folds // len(own) % folds
    return labels


def unfinished(search: Search, best: Hypothesis) -> bool:
    """Whether so much structure is left that the answer cannot be complete."""
    settings = UnexplainedSettings
    power, structure = structured(search, best)
    if not best or structure <= settings.structure:
        return structure > settings.structure
    before, _ = structured(search, NULL)
    return structure > settings.left * max(before - power, 0.0)
