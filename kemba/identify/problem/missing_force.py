"""Forces that a model may lack: their estimate in time, where they stand out, and simple terms.

A missing force is a first-order lag of white noise whose strength is learnt from the log. Prior and
noise make a tridiagonal system, which is fast for long logs.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky_banded, solveh_banded

from kemba.effects.mechanics.piston import V_COULOMB
from kemba.events import runs
from kemba.identify.problem.problem import Array, MissingForce

MEMORY = 0.025  # correlation time of the missing force [s]
ROUNDS = 20  # rounds in which its strength is learnt
BEGIN = 5.0  # strength (1 sigma) with which learning begins [N]
NEGLIGIBLE = 0.05  # strength that is as good as none [N]


def missing_along(
    run: str,
    time: Array,
    gap: Array,
    variance: Array,
    channel: tuple[str, str],
    strength: Array | None = None,
) -> MissingForce:
    """The force that is missing in one channel (name and unit) of a run, with its band.

    `time` (n,) [s]; `gap` (n,): the force plus white noise of `variance` (n,). Its `strength` (1,),
    1 sigma, is learnt when it is not given.
    """
    keep = np.exp(-np.diff(time) / MEMORY)
    sigma = BEGIN if strength is None else float(strength[0])
    for _ in range(ROUNDS if strength is None else 1):
        used = sigma
        bands = _precision(keep, sigma)
        bands[1] += 1.0 / variance
        mean = solveh_banded(bands, gap / variance)
        spread = _inverse_diagonal(bands)
        sigma = max(float(np.sqrt(np.mean(mean**2 + spread))), NEGLIGIBLE)
    name, unit = channel
    columns = mean[:, None], np.sqrt(spread)[:, None]
    return MissingForce(run, time, (name,), (unit,), *columns, np.array([used]))


def _precision(keep: Array, strength: float) -> Array:
    """Inverse covariance of the lag as bands (2, n): the upper one, then the diagonal."""
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


@dataclass(frozen=True)
class Peak:
    """The largest force that one channel lacks: where, how much, its 95 % interval."""

    channel: str
    unit: str
    run: str
    time_s: float
    value: float
    low: float
    high: float
    rms: float


def peaks(found: list[MissingForce]) -> list[Peak]:
    """Per channel the moment at which the missing force stands out most from its band."""
    chosen = []
    for k, channel in enumerate(found[0].channels):
        clear = [np.max(np.abs(m.force[:, k]) / m.sigma[:, k]) for m in found]
        m = found[int(np.argmax(clear))]
        i = int(np.argmax(np.abs(m.force[:, k]) / m.sigma[:, k]))
        value, spread = float(m.force[i, k]), 1.96 * float(m.sigma[i, k])
        rms = float(np.sqrt(np.mean(np.concatenate([m.force[:, k] for m in found]) ** 2)))
        at = float(m.time[i])
        chosen.append(
            Peak(channel, m.units[k], m.run, at, value, value - spread, value + spread, rms)
        )
    return chosen


def spans(time: Array, flags: Array) -> tuple[tuple[float, float], ...]:
    """Intervals [s] in which `flags` (n,) holds."""
    last = len(time) - 1
    return tuple((float(time[a]), float(time[min(b, last)])) for a, b in runs(flags.astype(bool)))


RANGES = (0.003, 0.005, 0.008, 0.013, 0.02)  # reach of a force at an end of the stroke [m]


def rod_terms(
    x: Array, v: Array, stroke: float, creeps: Iterable[float]
) -> Iterator[tuple[str, Array]]:
    """(formula, force on a rod per unit coefficient (n, ...)) of its extension x (n, ...) [m] and
    rate v [m.s-1]; `stroke` [m]; `creeps` [m]: travels over which a hysteresis turns round."""
    sign = np.tanh(v / V_COULOMB)
    for d in RANGES:
        yield f"exp(-(x/{d:g})**2)", np.exp(-((x / d) ** 2))
        yield f"exp(-(({stroke:g} - x)/{d:g})**2)", np.exp(-(((stroke - x) / d) ** 2))
    yield f"(x - {stroke / 2:g})**3", (x - stroke / 2) ** 3
    yield "max(v, 0)", np.maximum(v, 0.0)
    yield "v**3", v**3
    yield f"max(tanh(v/{V_COULOMB:g}), 0)", np.maximum(sign, 0.0)
    yield f"tanh(v/{V_COULOMB:g})*x", sign * x
    for travel in creeps:
        yield f"dahl(x, {travel:g})", dahl(x, travel)


def dahl(x: Array, travel: float) -> Array:
    """Hysteresis (n, ...): z' = (v - abs(v) z)/travel along paths x (n, ...) [m].

    Dahl's model of friction: the force changes its sign over a `travel` [m].
    """
    out = np.zeros(x.shape)
    for i, step in enumerate(np.diff(x, axis=0), start=1):
        target = np.where(step > 0, 1.0, -1.0)
        out[i] = target + (out[i - 1] - target) * np.exp(-np.abs(step) / travel)
    return out
