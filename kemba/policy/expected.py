"""What executions are expected to do, and what a measurement says of the state in them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from kemba.policy.modes import Array
from kemba.policy.settings import WINDOW
from kemba.trajectory import Trajectory


@dataclass(frozen=True)
class Expected:
    """The mean (rows, k) of what is measured, and the slopes (rows, n, 2 k) by which the deviation
    of the state x follows from measured deviations and their rates.

    The slopes are the best linear estimate: what sensors add by noise, and what is usual in
    executions, are weighed against each other. So noise alone moves nothing, and chambers that are
    not measured are inferred from what is.
    """

    mean: Array
    estimate: Array


def expected_from(
    executions: Sequence[Trajectory],
    clock: Array,
    measured: Sequence[str],
    states: Sequence[str],
    noise: Mapping[str, float],
) -> Expected:
    """What `executions` of a table under various conditions do at the times `clock` (rows,) [s].

    `noise`: 1 sigma by the ending of a measured column, in its unit.
    """
    y = np.array([_columns(motion, clock, measured) for motion in executions])
    x = np.array([_columns(motion, clock, states) for motion in executions])
    mean = y.mean(axis=0)
    y, x = y - mean, x - x.mean(axis=0)
    both = np.concatenate([y, _rates(y, clock)], axis=2)
    count = len(executions)
    sigma = np.array([noise.get(name.split("/")[-1], 0.0) for name in measured])
    added = _noise(sigma, float(np.median(np.diff(clock))))
    across = np.einsum("erx,ery->rxy", x, both) / count
    own = np.einsum("erx,ery->rxy", both, both) / count + added
    return Expected(mean, across @ np.linalg.pinv(own, hermitian=True))


def _columns(motion: Trajectory, clock: Array, names: Sequence[str]) -> Array:
    """Columns (rows, k) at the times of a clock; zero where the motion has no such column."""
    found = np.zeros((len(clock), len(names)))
    for k, name in enumerate(names):
        if name in motion:
            found[:, k] = np.interp(clock, motion.time, motion[name])
    return found


def _rates(y: Array, clock: Array) -> Array:
    """Rates (executions, rows, k) as the player has them: by a line through the last ticks."""
    period = float(np.median(np.diff(clock)))
    found = np.zeros_like(y)
    for row in range(2, y.shape[1]):
        first = max(0, row - WINDOW + 1)
        weights = _line(row - first + 1, period)
        found[:, row] = np.einsum("t,etk->ek", weights, y[:, first : row + 1])
    return found


def _line(count: int, period: float) -> Array:
    """Weights (count,) [s-1] by which successive values give the slope of a line through them."""
    time = (np.arange(count) - (count - 1) / 2) * period
    return np.asarray(time / (time @ time))


def _noise(sigma: Array, period: float) -> Array:
    """Covariance (2 k, 2 k) of the noise of values and their rates."""
    weights = _line(WINDOW, period)
    values = np.diag(sigma**2)
    between, rates = values * weights[-1], values * (weights @ weights)
    return np.block([[values, between], [between, rates]])
