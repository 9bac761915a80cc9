"""How much force a bench model lacks: the measured force less the predicted, freed of noise.

The missing force is a first-order lag driven by noise, as on the robot; how strong it is, is learnt
from the log. Prior and noise make a tridiagonal system, so that long logs cost nothing.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import cholesky_banded, solveh_banded

from kemba.identify.bench.predicted import PredictedLogs
from kemba.identify.evidence.types import Array, MissingForce, Theta
from kemba.settings import BY_HAND, Settings, setting

FORCE = "piston/F"


class BenchMissingSettings(Settings):
    """The missing force of a bench log."""

    memory: float = setting(0.025, "s", "correlation time of the missing force", BY_HAND)
    rounds: int = setting(20, "1", "rounds in which its strength is learnt", BY_HAND)
    begin: float = setting(5.0, "N", "strength (1 sigma) with which learning begins", BY_HAND)
    negligible: float = setting(0.05, "N", "strength that is as good as none", BY_HAND)


def bench_missing(
    predicted: PredictedLogs, theta: Theta, strength: Array | None = None
) -> list[MissingForce]:
    """d(t) per run: the force on the rod, with its band."""
    found = []
    for i, run in enumerate(predicted.logs):
        expected, variance = predicted.readings(theta, i)[FORCE]
        keep = run.keep[FORCE]
        time, gap = run.motion.time[keep], (run.measured[FORCE] - expected)[keep]
        known = None if strength is None else float(strength[0])
        force, sigma, used = lagged(time, gap, variance[keep], known)
        found.append(MissingForce(run.name, time, (FORCE,), ("N",), force[:, None], sigma[:, None],
                             np.array([used])))  # fmt: skip
    return found


def lagged(
    time: Array, gap: Array, variance: Array, known: float | None = None
) -> tuple[Array, Array, float]:
    """(estimate, 1 sigma), both (n,), and strength of a lag seen as `gap` (n,) in white noise of
    `variance` (n,); its strength is learnt unless it is `known`."""
    settings = BenchMissingSettings.current()
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
    """Inverse covariance of the lag: upper bands (2, n), the diagonal below."""
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
