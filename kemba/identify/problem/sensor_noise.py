"""Noise of a sensor as white noise and first-order lags, told from autocovariances.

A first-order lag of white noise is AR(1) noise: an exponential memory. What a flexible model leaves
over has the noise of the sensors in it, seen through a filter. Each kind of noise (white, or a lag
of some memory, at some channel) would make its own autocovariances behind that filter; a simulation
through the same filter tells which. The measured autocovariances are a sum of them with positive
weights: the variances of the kinds.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from kemba.identify.problem.problem import Array, Flags


@dataclass(frozen=True)
class ChannelNoise:
    """Noise of one channel, in its stated sigma: `white` (1 sigma), and `lags`: sigma and memory
    [s] of every first-order lag."""

    white: float = 1.0
    lags: tuple[tuple[float, float], ...] = ()

    @property
    def spread(self) -> float:
        """Standard deviation of the whole noise."""
        return float(np.sqrt(self.white**2 + sum(sigma**2 for sigma, _ in self.lags)))

    def covariance(self, apart: Array) -> Array:
        """Covariance (n,) of two readings `apart` (n,) [s], in stated sigmas squared."""
        lags = sum(s**2 * np.exp(-np.abs(apart) / memory) for s, memory in self.lags)
        return np.asarray(np.where(apart == 0.0, self.white**2, 0.0) + lags)


class ColourSettings:
    """How the colour of sensors is learnt."""

    # memories of coloured noise that are tried [s]: each twice the one before, from two rows to the
    # time of a stride's phase
    memories = (2e-3, 4e-3, 8e-3, 16e-3, 32e-3, 64e-3)
    drifts = (0.25, 1.0)  # memories of a drift that are tried [s]: as long as a log
    force = 0.025  # memory of the forces that may be missing [s]
    # rows between two errors whose covariance is compared: denser where colour changes fast
    lags = (0, 1, 2, 3, 4, 5, 6, 8, 10, 13, 16, 20, 26, 32, 40, 50, 64, 80, 100)
    draws = 5  # simulated logs of each kind of noise
    fewest = 200  # rows of a channel below which no colour is learnt
    least = 0.6  # smallest noise that is believed, in stated sigmas: as on the bench
    sharpest = 0.1  # smallest share of the noise's sigma that is white: a sound filter
    slight = 0.5  # sigma of a lag below which it is left out, as a share of what is as fast
    plain = 10.0  # gain in chi2 per lag from which a channel is coloured


@dataclass(frozen=True)
class Kind:
    """One kind of noise: of which channel (or force), and with which memory [s] (0: white)."""

    channel: int
    memory: float


def learnt_noise(
    errors: Array, counts: Array, made: Mapping[Kind, Array], most: Array
) -> tuple[ChannelNoise, ...]:
    """The noise of each of the first channels: white, unless lags explain its autocovariances
    clearly better, or where too few rows are known.

    `errors` (n, L, m), NaN where there is none; `counts` (m, lags) as `pairs` gives them; `made`:
    autocovariances (m, lags) that each kind of noise would make of unit variance; `most`
    (channels,): largest spread that is believed.
    """
    measured = covariances(errors[..., None], errors, counts)
    known = counts[: len(most), 0] >= ColourSettings.fewest
    return chosen_noise(made, measured, counts, most, known)


def chosen_noise(
    made: Mapping[Kind, Array], measured: Array, counts: Array, most: Array, known: Flags
) -> tuple[ChannelNoise, ...]:
    """The same from `measured` autocovariances (m, lags); `known` (channels,)."""
    weight = np.sqrt(counts) / np.maximum(measured[:, :1], 1e-9)  # chi2 of every covariance
    a = np.stack([(c * weight).ravel() for c in made.values()], axis=1)
    b = (measured * weight).ravel()
    settings = ColourSettings
    scale = np.maximum(np.linalg.norm(a, axis=0), 1e-12)
    drift = min(settings.drifts)

    def fit(allowed: Flags) -> tuple[Array, float]:
        x, left = nnls(np.where(allowed, a / scale, 0.0), b)
        return np.where(allowed, x / scale, 0.0), float(left) ** 2

    allowed = np.ones(len(made), dtype=bool)
    x, chi2 = fit(allowed)
    channel, memory = (
        np.array(x) for x in zip(*((k.channel, k.memory) for k in made), strict=True)
    )

    def lags_of(i: int) -> list[Flags]:
        """Which kinds are colour of a channel, and which are its drift."""
        own = (channel == i) & (memory > 0)
        return [own & (memory < drift), own & (memory >= drift)]

    for i in range(len(most)):
        for own in lags_of(i):
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
        for own in lags_of(i):
            if x[own].sum() > 0.0:
                mean = float(np.exp(np.average(np.log(memory[own]), weights=x[own])))
                lags.append((float(np.sqrt(x[own].sum())), mean))
        found.append(_sound(np.sqrt(white), lags, float(most[i])) if known[i] else ChannelNoise())
    return tuple(found)


def _sound(white: float, lags: Sequence[tuple[float, float]], most: float) -> ChannelNoise:
    """A channel's noise, lags the fastest first, within what is believed (`most`)."""
    settings = ColourSettings
    whole = ChannelNoise(white, tuple(lags)).spread
    if len(lags) > 1 and whole > most:
        (slowest, memory), excess = lags[-1], whole**2 - most**2
        lags = [*lags[:-1], (float(np.sqrt(max(slowest**2 - excess, 0.0))), memory)]
        whole = ChannelNoise(white, tuple(lags)).spread
    kept, power = [], white**2
    for sigma, memory in lags:
        power += sigma**2
        if sigma > settings.slight * max(np.sqrt(power), settings.least):
            kept.append((sigma, memory))
    if not kept:
        return ChannelNoise()
    scale = min(max(whole, settings.least), most) / max(whole, 1e-9)
    white = max(white, settings.sharpest * whole)
    return ChannelNoise(scale * white, tuple((scale * s, memory) for s, memory in kept))


def lag_noise(memories: Sequence[float], h: Array, draws: int, rng: np.random.Generator) -> Array:
    """(n, L, memories, draws): first-order lags of the same white noise, of unit sigma; `h` (n, L)
    and `memories` [s], of which 0 is white."""
    white = rng.standard_normal((*h.shape, 1, draws))
    memory = np.maximum(memories, 1e-9)  # [s]; below any step
    keep = np.exp(-h[..., None] / memory)[..., None]
    out = np.repeat(white, len(memory), axis=2)
    out[1:] *= np.sqrt(1.0 - keep[:-1] ** 2)
    for k in range(1, len(out)):
        out[k] += keep[k - 1] * out[k - 1]
    return np.asarray(out)


def pairs(errors: Array) -> Array:
    """How many pairs of rows (m, lags) so many apart are known of errors (n, L, m)."""
    good, lags = np.isfinite(errors), ColourSettings.lags
    found = [(good[: len(good) - lag] & good[lag:]).sum(axis=(0, 1)) for lag in lags]
    return np.stack(found, axis=1).astype(float)


def covariances(columns: Array, errors: Array, counts: Array) -> Array:
    """Mean product (m, lags) of rows so many apart, of columns (n, L, m, c), where `errors`
    (n, L, m) are known; `counts` (m, lags): such pairs of rows."""
    known = np.where(np.isfinite(errors)[..., None], columns, 0.0)
    # a channel's rows one after the other: each lag is one dot product, which BLAS takes
    z = np.ascontiguousarray(np.moveaxis(known, 2, 0)).reshape(errors.shape[2], len(errors), -1)
    lags = ColourSettings.lags
    total = [[np.vdot(one[: len(one) - lag], one[lag:]) for lag in lags] for one in z]
    return np.asarray(np.array(total) / columns.shape[-1] / np.maximum(counts, 1.0))
