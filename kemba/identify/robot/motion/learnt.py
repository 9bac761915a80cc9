"""The colour of the sensors' noise, learnt from the filter's errors.

What a flexible model leaves over has the noise of the sensors in it, seen through the filter. Each
kind of noise (white, or a lag of some memory, at some channel) would make its own autocovariances
of these errors; a simulation through the same filter tells which. The measured autocovariances are
a sum of them with positive weights: the variances of the kinds. Missing forces are kinds, too, so
that what a model lacks is not taken for noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import nnls

from kemba.identify.robot.motion.colour import ChannelNoise
from kemba.identify.robot.motion.filter import Gains, System, innovations
from kemba.settings import BY_HAND, Settings, setting

Array = np.ndarray[Any, np.dtype[np.float64]]
Flags = np.ndarray[Any, np.dtype[np.bool_]]


class ColourSettings(Settings):
    """How the colour of a robot's sensors is learnt."""

    memories: tuple[float, ...] = setting(
        (2e-3, 4e-3, 8e-3, 16e-3, 32e-3, 64e-3),
        "s",
        "memories of coloured noise that are tried",
        "convention: each twice the one before, from two rows to the time of a stride's phase",
    )
    drifts: tuple[float, ...] = setting(
        (0.25, 1.0), "s", "memories of a drift that are tried", "convention: as long as a log"
    )
    force: float = setting(0.025, "s", "memory of the forces that may be missing", BY_HAND)
    lags: tuple[int, ...] = setting(
        (0, 1, 2, 3, 4, 5, 6, 8, 10, 13, 16, 20, 26, 32, 40, 50, 64, 80, 100),
        "1",
        "rows between two errors whose covariance is compared",
        "convention: denser where colour changes fast",
    )
    draws: int = setting(5, "1", "simulated logs of each kind of noise", BY_HAND)
    fewest: int = setting(200, "1", "rows of a channel below which no colour is learnt", BY_HAND)
    least: float = setting(
        0.6,
        "1",
        "smallest noise that is believed, in stated sigmas",
        "convention: as on the bench",
    )
    sharpest: float = setting(
        0.1, "1", "smallest share of the noise's sigma that is white", "convention: a sound filter"
    )
    slight: float = setting(
        0.5, "1", "sigma of a lag, as a share of the noise's, below which it is left out", BY_HAND
    )
    plain: float = setting(
        10.0, "1", "gain in chi2 per lag from which a channel is coloured", BY_HAND, decides=True
    )


@dataclass(frozen=True)
class _Kind:
    """One kind of noise: of which channel (or force), and with which memory [s] (0: white)."""

    channel: int
    memory: float


def learnt_noise(
    system: System,
    gain: Gains,
    errors: Array,
    sigma: Array,
    h: Array,
    pushes: Sequence[Array],
    most: Array,
    drifts: bool,
) -> tuple[ChannelNoise, ...]:
    """Noise of every channel, in units of its stated sigma.

    `errors` (n, L, m): whitened errors of a flexible model, NaN where there is none. `sigma`
    (L, channels): stated noise; `h` (n, L) [s]. `pushes`: acceleration (n, L, k) per unit of every
    force that may be missing. `most` (channels,): largest spread that is believed. `drifts`: slow
    drifts are looked for as well; only where the model is good, for what it lacks is slow, too.
    """
    settings, channels = ColourSettings.current(), sigma.shape[1]
    measured, counts = _covariances(errors[..., None], errors)
    known = counts[:channels, 0] >= settings.fewest
    if not known.any():
        return tuple(ChannelNoise() for _ in range(channels))
    kinds: list[_Kind] = []
    columns: list[Array] = []
    memories = (0.0, *settings.memories, *(settings.drifts if drifts else ()))
    draws, j, m = settings.draws, system.G.shape[-1], system.H.shape[2]
    for channel in range(channels):
        y = np.concatenate([_channel_noise(t, channel, sigma, h, m) for t in memories], axis=-1)
        seen = _through(system, gain, y, np.zeros((*h.shape, j, y.shape[-1])))
        parts = np.split(seen, len(memories), axis=-1)
        columns += [_covariances(part, errors)[0] for part in parts]
        kinds += [_Kind(channel, memory) for memory in memories]
    for i, push in enumerate(pushes):
        g = _force_noise(settings.force, push, h, j)
        seen = _through(system, gain, np.zeros((*h.shape, m, draws)), g)
        columns.append(_covariances(seen, errors)[0])
        kinds.append(_Kind(channels + i, settings.force))
    weight = np.sqrt(counts) / np.maximum(measured[:, :1], 1e-9)  # chi2 of every covariance
    a = np.stack([(c * weight).ravel() for c in columns], axis=1)
    return _chosen(a, (measured * weight).ravel(), kinds, most, known)


def _chosen(
    a: Array, b: Array, kinds: Sequence[_Kind], most: Array, known: Flags
) -> tuple[ChannelNoise, ...]:
    """The noise of each channel: white, unless lags explain `b` (rows,) clearly better."""
    settings = ColourSettings.current()
    scale = np.maximum(np.linalg.norm(a, axis=0), 1e-12)
    drift = min(settings.drifts)

    def fit(allowed: Array) -> tuple[Array, float]:
        x, left = nnls(np.where(allowed, a / scale, 0.0), b)
        return np.where(allowed, x / scale, 0.0), float(left) ** 2

    allowed = np.ones(len(kinds), dtype=bool)
    x, chi2 = fit(allowed)
    channel = np.array([k.channel for k in kinds])
    memory = np.array([k.memory for k in kinds])
    groups = [(0.0, drift), (drift, np.inf)]  # colour, drift
    for i in range(len(most)):
        for low, high in groups:
            own = (channel == i) & (memory > 0) & (memory >= low) & (memory < high)
            if not (x[own] > 0).any():
                allowed &= ~own
                continue
            trial_x, trial = fit(allowed & ~own)
            if trial - chi2 < settings.plain:
                allowed, x, chi2 = allowed & ~own, trial_x, trial
    found = []
    for i in range(len(most)):
        white = float(x[(channel == i) & (memory == 0.0)].sum())
        lags = []
        for low, high in groups:
            own = (channel == i) & (memory > 0) & (memory >= low) & (memory < high)
            if x[own].sum() > 0.0:
                mean = float(np.exp(np.average(np.log(memory[own]), weights=x[own])))
                lags.append((float(np.sqrt(x[own].sum())), mean))
        found.append(_sound(np.sqrt(white), lags, float(most[i])) if known[i] else ChannelNoise())
    return tuple(found)


def _sound(white: float, lags: Sequence[tuple[float, float]], most: float) -> ChannelNoise:
    """A channel's noise within what is believed; without lags it is as stated."""
    settings = ColourSettings.current()
    whole = ChannelNoise(white, tuple(lags)).spread
    kept = [(s, memory) for s, memory in lags if s > settings.slight * max(whole, settings.least)]
    if not kept:
        return ChannelNoise()
    scale = min(max(whole, settings.least), most) / max(whole, 1e-9)
    white = max(white, settings.sharpest * whole)
    return ChannelNoise(scale * white, tuple((scale * s, memory) for s, memory in kept))


def _channel_noise(memory: float, channel: int, sigma: Array, h: Array, m: int) -> Array:
    """Noise (n, L, m, draws) of one channel, of one stated sigma; `memory` [s]: 0 is white."""
    draws = ColourSettings.current().draws
    rng = np.random.default_rng(17 + channel)
    y = np.zeros((*h.shape, m, draws))
    y[:, :, channel] = sigma[:, channel, None] * _lag(memory, h, draws, rng)
    return y


def _force_noise(memory: float, push: Array, h: Array, j: int) -> Array:
    """Accelerations (n, L, j, draws) of one force of unit sigma."""
    draws = ColourSettings.current().draws
    force = _lag(memory, h, draws, np.random.default_rng(5))
    g = np.zeros((*h.shape, j, draws))
    g[:, :, : push.shape[2]] = push[..., None] * force[:, :, None]
    return g


def _lag(memory: float, h: Array, draws: int, rng: np.random.Generator) -> Array:
    """(n, L, draws): a first-order lag of white noise, of unit sigma."""
    out = rng.standard_normal((*h.shape, draws))
    if memory:
        keep = np.exp(-h / memory)[..., None]
        drive = np.sqrt(1.0 - keep**2)
        for k in range(1, len(out)):
            out[k] = keep[k - 1] * out[k - 1] + drive[k - 1] * out[k]
    return np.asarray(out)


def _through(system: System, gain: Gains, y: Array, g: Array) -> Array:
    """Whitened errors (n, L, m, c) that noise of the sensors `y` (n, L, m, c) and accelerations `g`
    (n, L, j, c) make."""
    _, found = innovations(system, gain, y, g)
    return np.asarray(gain.whitener @ found)


def _covariances(columns: Array, errors: Array) -> tuple[Array, Array]:
    """Mean product (m, lags) of rows so many apart, of columns (n, L, m, c), where `errors`
    (n, L, m) are known; and how many such pairs of rows there are (m, lags)."""
    lags = ColourSettings.current().lags
    good = np.isfinite(errors)
    z = np.where(good[..., None], columns, 0.0)
    total, count = [], []
    for lag in lags:
        end = len(z) - lag
        pairs = (good[:end] & good[lag:]).sum(axis=(0, 1))
        product = np.einsum("nlmc,nlmc->m", z[:end], z[lag:]) / z.shape[-1]
        total.append(product / np.maximum(pairs, 1))
        count.append(pairs)
    return np.stack(total, axis=1), np.stack(count, axis=1).astype(float)
