"""How much force a bench model lacks: the measured force less the predicted one, smoothed.

The missing force is a first-order lag of white noise, as on the robot; its strength is learnt from
the log. Prior and noise make a tridiagonal system, which is fast for long logs.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import cholesky_banded, solveh_banded

from kemba.identify.bench.predicted import PredictedLogs
from kemba.identify.problem.types import Array, MissingForce, Theta

FORCE = "piston/F"


class BenchMissingSettings:
    """The missing force of a bench log."""

    memory = 0.025  # correlation time of the missing force [s]
    rounds = 20  # rounds in which its strength is learnt
    begin = 5.0  # strength (1 sigma) with which learning begins [N]
    negligible = 0.05  # strength that is as good as none [N]


def bench_missing(
    predicted: PredictedLogs, theta: Theta, strength: Array | None = None
) -> list[MissingForce]:
    """d(t) [N] per run: the force on the rod, with its band; `strength` (1,) [N], learnt when not
    given."""
    found = []
    for i, log in enumerate(predicted.logs):
        expected, variance = predicted.readings(theta, i)[FORCE]
        keep = log.keep[FORCE]
        time, gap = log.motion.time[keep], (log.measured[FORCE] - expected)[keep]
        known = None if strength is None else float(strength[0])
        force, sigma, used = lagged(time, gap, variance[keep], known)
        found.append(MissingForce(log.name, time, (FORCE,), ("N",), force[:, None], sigma[:, None],
                             np.array([used])))  # fmt: skip
    return found


def lagged(
    time: Array, gap: Array, variance: Array, known: float | None = None
) -> tuple[Array, Array, float]:
    """Estimate (n,) and 1 sigma (n,) of a first-order lag, and its strength.

    `time` (n,) [s]; `gap` (n,): the lag plus white noise of `variance` (n,). The strength (1 sigma
    of the lag) is learnt unless it is `known`.
    """
    settings = BenchMissingSettings
    keep = np.exp(-np.diff(time) / settings.memory)
    strength = known or settings.begin
    for _ in range(1 if known else settings.rounds):
        used = strength
        bands = _precision(keep, strength)
        bands[1] += 1.0 / variance
        mean = solveh_banded(bands, gap / variance)
        spread = _inverse_diagonal(bands)
        strength = max(float(np.sqrt(np.mean(mean**2 + spread))), settings.negligible)
    return np.asarray(mean), np.sqrt(spread), used


def _precision(keep: Array, strength: float) -> Array:
    """Inverse covariance of the lag as bands (2, n): the upper one, then the diagonal.

    `keep` (n - 1,): share of the lag that is left after each step.
    """
    driven = strength**2 * np.maximum(1.0 - keep**2, 1e-12)
    bands = np.zeros((2, len(keep) + 1))
    bands[1, 0] = 1.0 / strength**2
    bands[1, 1:] = 1.0 / driven
    bands[1, :-1] += keep**2 / driven
    bands[0, 1:] = -keep / driven
    return bands


def _inverse_diagonal(bands: Array) -> Array:
    """Diagonal of the inverse of a tridiagonal matrix, from its pivots in both directions."""
    forward = cholesky_banded(bands)[1] ** 2
    turned = np.stack([np.append(0.0, bands[0, :0:-1]), bands[1, ::-1]])
    backward = cholesky_banded(turned)[1, ::-1] ** 2
    return np.asarray(1.0 / (forward + backward - bands[1]))
