"""Coloured noise: a short autoregression, learnt on what a flexible model leaves over."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.ndimage import maximum_filter1d, uniform_filter1d
from scipy.signal import lfilter

from kemba.identify.evidence.problem import Array

ORDER = 4
SPIKE, AROUND, SPIKY = 7, 151, 5.0  # rows, rows, ratio of mean squares
LEAST = 0.6  # of the white noise: what a flexible model leaves is never believed to be less
FEWEST, KEPT = 11, 0.9  # values, and share of their third differences, that tell the noise
KEPT_SPREAD = 0.7893  # 1 sigma of a normal's smallest 90 % in size, by its own sigma
TRIM = 5.0  # rows beyond so many sigma are switching instants, not noise


def difference_sigma(values: Array) -> float:
    """White noise (1 sigma) per sample of a channel (n,); 0 where there are too few values.

    From third differences, in which smooth motion cancels. The largest tenth is left out: impacts
    and switching valves are no noise. A quantised channel is never better than its own steps.
    """
    known = values[np.isfinite(values)]
    if len(known) < FEWEST:
        return 0.0
    rough = np.sort(np.abs(np.diff(known, n=3)))[: int(KEPT * (len(known) - 3))]
    noise = float(np.sqrt(np.mean(rough**2) / 20.0)) / KEPT_SPREAD  # 20 = 1 + 9 + 9 + 1
    steps = np.diff(np.unique(known))
    return max(noise, float(steps.min() / np.sqrt(12.0)) if len(steps) else 0.0)


@dataclass(frozen=True)
class Colour:
    """AR model r_t = sum phi_k r_{t-k} + sigma e_t of a standardised residual."""

    phi: Array
    sigma: float
    weight: Array | None = None  # (n,) below 1 where the residual has a spike

    @property
    def spread(self) -> float:
        """Standard deviation of the coloured series itself."""
        impulse = np.zeros(2000)
        impulse[0] = 1.0
        response = lfilter([1.0], np.concatenate([[1.0], -self.phi]), impulse)
        return float(self.sigma * np.sqrt(np.sum(response**2)))


def learn(residual: Array, order: int = ORDER, careful: bool = False) -> Colour:
    """Yule-Walker fit, order by BIC; `careful`: spikes get less weight from now on."""
    weight = caution(residual) if careful else None
    found = _yule_walker(residual if weight is None else residual * weight, order)
    return replace(found, weight=weight)


def _yule_walker(residual: Array, order: int) -> Colour:
    scale = max(1.4826 * float(np.median(np.abs(residual))), 0.2)
    r = np.clip(residual, -TRIM * scale, TRIM * scale)
    n = len(r)
    if n < 50:
        return Colour(np.zeros(0), max(float(np.sqrt(np.mean(r**2))), LEAST))
    c = np.array([np.dot(r[: n - k], r[k:]) / n for k in range(order + 1)])
    best, chosen = np.inf, (np.zeros(0), float(c[0]))
    for p in range(order + 1):
        phi = solve_toeplitz(c[:p], c[1 : p + 1]) if p else np.zeros(0)
        power = max(float(c[0] - phi @ c[1 : p + 1]), 1e-6)
        bic = n * np.log(power) + p * np.log(n)
        if bic < best - 1e-9:
            best, chosen = bic, (phi, power)
    return Colour(chosen[0], max(float(np.sqrt(chosen[1])), LEAST))


def caution(residual: Array) -> Array:
    """Weights (n,) that silence spikes: a few rows far off amid rows that are not.

    Switching instants and reversals are where the imposed motion is known worst. What is off for
    long is left alone: it may be physics.
    """
    power = residual**2
    near, around = uniform_filter1d(power, SPIKE), uniform_filter1d(power, AROUND)
    spike = near > SPIKY * np.maximum(around, 1.0)
    spike = maximum_filter1d(spike, SPIKE)
    return np.where(spike, 1.0 / np.sqrt(np.maximum(near, 1.0)), 1.0)


def whiten(residual: Array, colour: Colour) -> Array:
    """e_t = (r_t - sum phi_k r_{t-k}) / sigma along the first axis of (n,) or (n, k).

    The first rows are scaled by the series' spread instead.
    """
    if colour.weight is not None:
        residual = (residual.T * colour.weight).T
    taps = np.concatenate([[1.0], -colour.phi])
    white = lfilter(taps, [1.0], residual, axis=0) / colour.sigma
    p = len(colour.phi)
    if p:
        white[:p] = residual[:p] / max(colour.spread, colour.sigma)
    return np.asarray(white)
