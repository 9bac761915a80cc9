"""Noise of a channel: its steps, its white part, its slow drift, and its colour.

A drift of one sigma moves a reading no further than its noise, but for a second instead of a row,
and so it looks like a small force, or like a faulty sensor.

Colour of a sensor is told from autocovariances. A first-order lag of white noise is AR(1) noise:
an exponential memory. What a flexible model leaves over has the noise of the sensors in it, seen
through a filter. Each kind of noise (white, or a lag of some memory, at some channel) would make
its own autocovariances behind that filter; a simulation through the same filter tells which. The
measured ones are a sum of them with positive weights: the variances of the kinds. Where nothing
stands between, colour is a short autoregression of what is left over.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from statistics import NormalDist
from types import MappingProxyType

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.ndimage import maximum_filter1d, uniform_filter1d
from scipy.optimize import nnls
from typing_extensions import Self

from kemba.identify.problem.problem import Array, Flags, Labels, Problem, Rows


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


Kind = tuple[int, float]  # of noise: of which channel (or force), which memory [s] (0: white)


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
    channel, memory = np.array(list(made)).T

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


# How the step of a sensor is found.
# readings closer than this share of their range are one reading: conversion of units rounds in
# the fifteenth digit, files have six or more
SAME = 1e-6
# readings come in steps where most differences of neighbours are whole steps: of what moves
# without a rest, the smallest difference is its slowest motion
NEAR = 0.15  # distance from a whole number of steps that rounding in a file makes
FEW = 5.5  # differences of more steps tell nothing, since the error of the step adds up
MOST = 0.6  # share of differences that are whole steps; by chance 0.3 are
# steps of so many sigmas of the noise are coarse: below it, noise makes rounding errors
# independent (Widrow and Kollar 2008)
COARSE = 2.0
LONGEST = 1000  # rows at rest that count as one reading; of a longer rest more count


def step_of(values: Array) -> float:
    """The step in which a channel (n,) is read, in its unit; 0 where it has none."""
    known = np.unique(values[np.isfinite(values)])
    steps = np.diff(known)
    if not len(steps):
        return 0.0
    steps = steps[steps > SAME * np.ptp(known)]
    counts = steps / steps.min()
    counts = counts[counts < FEW]
    whole = np.abs(counts - np.round(counts)) < NEAR
    return float(steps.min()) if np.mean(whole) > MOST else 0.0


def is_coarse(step: float, sigma: float) -> bool:
    """Whether a sensor's step is so much larger than its noise that rounding errors depend on each
    other."""
    return step > COARSE * sigma


def telling(values: Array, sigma: float) -> Flags:
    """Rows (n,) that tell something of their own: of readings that stand still, the middle one.

    Readings stand still where they keep to one step, or change to and fro between two. They have
    one rounding error in common, so that many of them tell no more than one. Where the noise
    `sigma` is as large as the steps, each reading is rounded by itself and all rows count.
    """
    step = step_of(values)
    if not is_coarse(step, sigma):
        return np.ones(len(values), dtype=bool)
    chosen = np.zeros(len(values), dtype=bool)
    known = np.flatnonzero(np.isfinite(values))
    level = np.round(values[known] / step).astype(int)
    first = 0
    while first < len(level):
        last = first + _still(level[first:])
        chosen[known[(first + last - 1) // 2]] = True
        first = last
    return chosen


def _still(level: Labels) -> int:
    """How many of the first readings (n,), counted in steps, keep to one level or to two."""
    level = level[:LONGEST]
    low, high = np.minimum.accumulate(level), np.maximum.accumulate(level)
    moved = high - low > 1
    return int(np.argmax(moved)) if moved.any() else len(moved)


# Drifts that any sensor may have.
WAVES = 8  # cosines of a run: 92 to 99 % of the variance of a lag of 1 s in 0.5 to 4 s
DRIFT = 1.0  # sigma of a drift, in stated sigmas: as the noise


def drift_waves(time: Array) -> tuple[Array, Array]:
    """Cosines (n, d) of a run's rows at `time` (n,) [s], and the standard deviations (d,) that make
    a drift of them."""
    length = max(float(np.ptp(time)), 1e-9)
    order = np.arange(float(WAVES))
    memory = max(ColourSettings.drifts)  # of a lag of unit variance, which the cosines make
    variance = np.where(order == 0, 0.5, 1.0) / (1.0 + (np.pi * order * memory / length) ** 2)
    mean = variance @ np.where(order == 0, 1.0, 0.5)
    sigmas = DRIFT * np.sqrt(variance / mean)
    return np.cos(np.pi * np.outer((time - time[0]) / length, order)), np.asarray(sigmas)


@dataclass(frozen=True)
class DriftNoise:
    """A drift whose size is not known, in white rows: they have the covariance I + UU'.

    `shape` (n, d): orthonormal; `variance` (d,): of the drift along it.
    """

    shape: Array
    variance: Array

    @classmethod
    def of(cls, columns: Array) -> DriftNoise:
        """Of columns U (n, d), one per cosine of unit sigma, whitened."""
        shape, size, _ = np.linalg.svd(columns, full_matrices=False)
        return cls(shape, size**2)

    def out_of(self, rows: Array) -> Array:
        """(I + UU')^-1/2 rows, of (n,) or (n, k): white again; not a number where a row has none,
        as of a model that cannot be simulated."""
        lost = 1.0 - 1.0 / np.sqrt(1.0 + self.variance)
        with np.errstate(invalid="ignore"):
            return np.asarray(rows - (self.shape * lost) @ (self.shape.T @ rows))

    @property
    def log_density(self) -> float:
        """What the drift adds to the log density [nats] of rows that are zero."""
        return -0.5 * float(np.sum(np.log1p(self.variance)))


# How the colour of the noise is learnt.
ORDER = 4  # largest order of the autoregression: BIC chooses among 0 to this
FEWEST = 50  # rows below which no colour is learnt
# smallest noise that is believed, as a share of the sensor's white noise; a flexible model fits
# some of the noise
LEAST = 0.6
TRIM = 5.0  # residuals beyond so many sigma are clipped: they are switching instants
SOFTEST = 0.2  # smallest sigma that the clipping assumes
SPIKE = 7  # rows that a spike lasts
AROUND = 151  # rows around a spike that it is compared with
SPIKY = 5.0  # ratio of mean squares that makes a spike


# How the white noise of a channel is told from its motion.
FEWEST_VALUES = 11  # values that are needed to tell noise
# share of the third differences that count as noise, the smallest ones: by hand; impacts and
# switching valves take less than a tenth of a log
KEPT = 0.9


def difference_sigma(values: Array) -> float:
    """White noise (1 sigma) per sample of a channel (n,); 0 where there are too few values.

    From third differences, in which smooth motion cancels. The largest ones are left out: impacts
    and switching valves are no noise. A quantised channel is never better than its own steps.
    """
    known = values[np.isfinite(values)]
    if len(known) < FEWEST_VALUES:
        return 0.0
    rough = np.sort(np.abs(np.diff(known, n=3)))[: int(KEPT * (len(known) - 3))]
    noise = float(np.sqrt(np.mean(rough**2) / 20.0))  # 20 = 1 + 9 + 9 + 1
    normal = NormalDist()
    end = normal.inv_cdf(0.5 * (1.0 + KEPT))  # the smallest values of a normal have less spread
    noise /= float(np.sqrt(1.0 - 2.0 * end * normal.pdf(end) / KEPT))
    return max(noise, step_of(known) / float(np.sqrt(12.0)))


@dataclass(frozen=True)
class Colour:
    """AR model r_t = sum phi_k r_{t-k} + sigma e_t of a standardised residual of so many `rows`."""

    phi: Array
    sigma: float
    rows: int = 0
    weight: Array | None = None  # (n,) below 1 where the residual has a spike
    drift: DriftNoise | None = None  # that the series has besides

    @property
    def log_density(self) -> float:
        """Log density [nats] of rows that are zero, up to a constant."""
        found = -self.rows * float(np.log(self.sigma))
        if self.weight is not None:
            found += float(np.sum(np.log(self.weight)))
        return found + (self.drift.log_density if self.drift else 0.0)

    @property
    def spread(self) -> float:
        """Standard deviation of the coloured series itself."""
        from scipy.signal import lfilter  # rigs only: it takes half a second

        impulse = np.zeros(2000)
        impulse[0] = 1.0
        response = lfilter([1.0], np.concatenate([[1.0], -self.phi]), impulse)
        return float(self.sigma * np.sqrt(np.sum(response**2)))


def colours(
    rows: Rows, residual: Array, careful: bool, drifts: bool = False
) -> dict[tuple[int, int], Colour]:
    """The colour of a residual (n,) by run and channel; `drifts`: beside a slow drift."""
    found = {}
    for i, k in np.unique(np.stack([rows.run, rows.channel]), axis=1).T.tolist():
        own = (rows.run == i) & (rows.channel == k)
        left = residual[own]
        if not drifts:
            found[i, k] = learn(left, careful=careful)
            continue
        waves, sigmas = drift_waves(rows.time[own])
        slow = waves @ np.linalg.lstsq(waves, left, rcond=None)[0]
        plain = learn(left - slow, careful=careful)
        found[i, k] = replace(plain, drift=DriftNoise.of(whiten(waves * sigmas, plain)))
    return found


def learn(residual: Array, careful: bool = False) -> Colour:
    """Yule-Walker fit to a residual (n,), its order by BIC; `careful`: spikes get less weight from
    now on."""
    weight = caution(residual) if careful else None
    seen = residual if weight is None else residual * weight
    scale = max(1.4826 * float(np.median(np.abs(seen))), SOFTEST)
    r, n = np.clip(seen, -TRIM * scale, TRIM * scale), len(seen)
    if n < FEWEST:
        sigma = max(float(np.sqrt(np.mean(r**2))), LEAST)
        return Colour(np.zeros(0), sigma, n, weight)
    c = np.array([np.dot(r[: n - k], r[k:]) / n for k in range(ORDER + 1)])
    best, chosen = np.inf, (np.zeros(0), float(c[0]))
    for p in range(ORDER + 1):
        phi = solve_toeplitz(c[:p], c[1 : p + 1]) if p else np.zeros(0)
        power = max(float(c[0] - phi @ c[1 : p + 1]), 1e-6)
        bic = n * np.log(power) + p * np.log(n)
        if bic < best - 1e-9:
            best, chosen = bic, (phi, power)
    return Colour(chosen[0], max(float(np.sqrt(chosen[1])), LEAST), n, weight)


def caution(residual: Array) -> Array:
    """Weights (n,) that silence spikes: a few rows with a large error among rows with a small one.

    At switching instants and reversals the imposed motion is known worst. An error that lasts is
    left alone: it may be physics.
    """
    power = residual**2
    near, around = (uniform_filter1d(power, rows) for rows in (SPIKE, AROUND))
    spike = near > SPIKY * np.maximum(around, 1.0)
    spike = maximum_filter1d(spike, SPIKE)
    return np.where(spike, 1.0 / np.sqrt(np.maximum(near, 1.0)), 1.0)


def whiten(residual: Array, colour: Colour) -> Array:
    """e_t = (r_t - sum phi_k r_{t-k}) / sigma along the first axis of (n,) or (n, k).

    The first rows are scaled by the series' spread instead.
    """
    from scipy.signal import lfilter

    if colour.weight is not None:
        residual = (residual.T * colour.weight).T
    taps = np.concatenate([[1.0], -colour.phi])
    white = lfilter(taps, [1.0], residual, axis=0) / colour.sigma
    p = len(colour.phi)
    if p:
        white[:p] = residual[:p] / max(colour.spread, colour.sigma)
    return np.asarray(white) if colour.drift is None else colour.drift.out_of(white)


def whitened(rows: Rows, columns: Array, by: Mapping[tuple[int, int], Colour]) -> Array:
    """Columns (n, k) with the colour of every run and channel taken out."""
    out = columns.copy()
    for (i, k), colour in by.items():
        own = (rows.run == i) & (rows.channel == k)
        out[own] = whiten(columns[own], colour)
    return np.asarray(out)


class ColouredProblem(Problem):
    """A problem whose noise has a colour of its own in every run and channel.

    `colour` by run and channel; without any, residuals are not whitened. `left` (n,): the residual
    from which it was learnt.
    """

    learns_colour = True
    colour: Mapping[tuple[int, int], Colour] = MappingProxyType({})
    left: Array | None = None

    def recolour(self, residual: Array | None, careful: bool = False) -> Self:
        """The same problem with the colour of every run and channel learnt from `residual` (n,), or
        forgotten."""
        found = copy(self)
        found.left = residual
        found.colour = {} if residual is None else colours(self.rows(), residual, careful)
        return found

    def whiten(self, columns: Array) -> Array:
        """Columns (n, k) that were not whitened, as `jacobian` would return them."""
        return whitened(self.rows(), columns, self.colour)
