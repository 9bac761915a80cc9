"""A Kalman filter over several runs at once: gains once, then any number of columns through it; and
the noise of a robot's sensors, white noise and lags as states of the filter, stated or learnt.

A first-order lag of white noise is AR(1) noise: an exponential memory. The sum of white noise and
two lags also describes quantised channels and slow drift. It keeps its meaning where rows are
missing or nodes are not evenly spaced, which an AR model of rows does not. Where the noise is
learnt from the filter's errors, missing forces are kinds of noise, too, so that what a model lacks
is not taken for the noise of a sensor.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from kemba.identify.problem.noise import (
    ChannelNoise,
    ColourSettings,
    Kind,
    covariances,
    lag_noise,
    learnt_noise,
    pairs,
)
from kemba.identify.problem.problem import Array
from kemba.identify.robot.batch import Batch

# variance of a row that was not measured, over the largest variance: such a row tells nothing
MISSING = 1e12
# columns that pass at once: with all, the memory of `compare` is a quarter more: time of
# compare on five logs of 1 s; the same at 32, 7 % longer at 8
COLUMNS = 16


@dataclass(frozen=True)
class System:
    """Deviations from a reference, x' = F x + G (g + w), y = H x + n, over n steps of L runs.

    F (n, L, d, d), G (n, L, d, k), W (n, L, k, k) the covariance of w per step, H (n, L, m, d),
    R (n, L, m) variances of the rows (infinite: not measured), P0 (L, d, d). `lags`: so many of the
    last states are coloured noise of sensors.
    """

    F: Array
    G: Array
    W: Array
    H: Array
    R: Array
    P0: Array
    lags: int = 0

    def with_lags(self, keep: Array, size: Array) -> System:
        """The system with k lags of white noise as more states, which no row reads as yet.

        `keep` (n, L, k) or (n, L, 1): the share of a lag that a step keeps; `size` (L, k) or (k,):
        its 1 sigma.
        """
        k, d, j = size.shape[-1], self.F.shape[-1], self.G.shape[-1]
        F, G, W, P0 = (
            np.pad(a, [(0, 0)] * (a.ndim - 2) + [(0, k)] * 2)
            for a in (self.F, self.G, self.W, self.P0)
        )
        i = np.arange(k)
        F[..., d + i, d + i], G[..., d + i, j + i] = keep, 1.0
        W[..., j + i, j + i] = (1.0 - keep**2) * size**2
        P0[:, d + i, d + i] = size**2
        H = np.pad(self.H, [(0, 0)] * 3 + [(0, k)])
        return replace(self, F=F, G=G, W=W, H=H, P0=P0, lags=self.lags + k)


@dataclass(frozen=True)
class FilterGains:
    """What the filter makes of a System: whiteners of the innovations, predicted P, and what
    becomes of a predicted state and of a measurement in a step that corrects the state."""

    whitener: Array
    P: Array
    turn: Array
    carry: Array


def gains(system: System) -> FilterGains:
    """Run the covariance recursion."""
    s = system
    n, runs, m, d = s.H.shape
    known = np.isfinite(s.R)
    R = np.where(known, s.R, MISSING * np.nanmax(np.where(known, s.R, 0.0)))
    turn, P_all = np.empty_like(s.F), np.empty_like(s.F)
    carry, whitener = np.empty((n, runs, d, m)), np.empty((n, runs, m, m))
    P, diagonal = s.P0.copy(), np.arange(m)
    for k in range(n):
        P_all[k] = P
        PHt = P @ s.H[k].swapaxes(-1, -2)
        S = s.H[k] @ PHt
        S[:, diagonal, diagonal] += R[k]
        white = whitener[k] = np.linalg.inv(np.linalg.cholesky(S))
        c = carry[k] = s.F[k] @ (PHt @ white.swapaxes(-1, -2) @ white)
        t = turn[k] = s.F[k] - c @ s.H[k]
        # Joseph's form keeps P positive where a row is a thousand times sharper than the state
        P = t @ P @ t.swapaxes(-1, -2) + (c * R[k][:, None, :]) @ c.swapaxes(-1, -2)
        P += s.G[k] @ s.W[k] @ s.G[k].swapaxes(-1, -2)
        P = 0.5 * (P + P.swapaxes(-1, -2))
    return FilterGains(whitener, P_all, turn, carry)


def innovations(system: System, gain: FilterGains, y: Array | None, g: Array | None) -> Array:
    """Whitened innovations (n, L, m, c) of measurements y (n, L, m, c) and accelerations g
    (n, L, j, c) of the first j channels of G; None is zero."""
    count = max(a.shape[-1] for a in (y, g) if a is not None)
    whole = np.empty((*system.H.shape[:3], count))
    for part in at_once(count):
        own = (None if a is None else a[..., part] for a in (y, g))
        whole[..., part] = gain.whitener @ predicted(system, gain, *own)[1]
    return whole


def at_once(count: int) -> Iterator[slice]:
    """The parts of so many columns that pass the filter at once."""
    return (slice(i, i + COLUMNS) for i in range(0, count, COLUMNS))


def predicted(
    system: System, gain: FilterGains, y: Array | None, g: Array | None
) -> tuple[Array, Array]:
    """(predicted x (n, L, d, c), what is measured beyond it (n, L, m, c)) of the same columns."""
    s = system
    n, runs, _, d = s.H.shape
    given = [a.shape[-1] for a in (y, g) if a is not None]
    states = np.zeros((n, runs, d, given[0]))
    # one step at a time only what must be: x' = F (1 - K H) x + (F K y + G g)
    if y is not None:
        y = np.where(np.isfinite(y) & np.isfinite(s.R)[..., None], y, 0.0)
        y = np.ascontiguousarray(y)  # NumPy hands only such arrays to BLAS
        np.matmul(gain.carry[:-1], y[:-1], out=states[1:])
    if g is not None:
        states[1:] += s.G[:-1, ..., : g.shape[2]] @ np.ascontiguousarray(g[:-1])
    turned = np.empty(states.shape[1:])
    for turn, now, following in zip(gain.turn[:-1], states[:-1], states[1:], strict=True):
        np.matmul(turn, now, out=turned)
        following += turned
    seen = s.H @ states
    return states, (-seen if y is None else y - seen)


def smooth(
    system: System, gain: FilterGains, y: Array, g: Array, band: bool = False
) -> tuple[Array, Array, Array]:
    """(smoothed x (n, L, d), smoothed w (n, L, k), variances of x (n, L, d)) of one column (Bryson
    and Frazier); `g` (n, L, j) pushes the first j channels of G. Variances take as long as all
    else: without `band` they are zero."""
    s = system
    n, runs, _, d = s.H.shape
    states, errors = predicted(s, gain, y[..., None], g[..., None])
    errors = gain.whitener @ errors
    seen = np.where(np.isfinite(s.R)[..., None], s.H, 0.0)
    whitened = (gain.whitener @ seen).swapaxes(-1, -2)
    x, variance = np.empty((n, runs, d)), np.zeros((n, runs, d))
    w = np.empty((n, runs, s.G.shape[-1]))
    pull, certainty = np.zeros((runs, d, 1)), np.zeros((runs, d, d))
    for k in reversed(range(n)):
        w[k] = (s.W[k] @ (s.G[k].swapaxes(-1, -2) @ pull))[..., 0]
        back, P = gain.turn[k].swapaxes(-1, -2), gain.P[k]
        pull = whitened[k] @ errors[k] + back @ pull
        x[k] = (states[k] + P @ pull)[..., 0]
        if band:
            certainty = whitened[k] @ whitened[k].swapaxes(-1, -2) + back @ certainty @ gain.turn[k]
            variance[k] = np.diagonal(P, axis1=1, axis2=2) - ((P @ certainty) * P).sum(axis=2)
    return x, w, np.maximum(variance, 0.0)


Noise = Sequence[ChannelNoise]  # one per channel; empty: all are white


def coloured(system: System, noise: Noise, sigma: Array, h: Array) -> System:
    """The filter's system with every lag of `noise` as one more state.

    `system`: white, with the channels as its first rows; `sigma` (L, m): stated noise of each run's
    channels; `h` (n, L) [s]: length of each step.
    """
    if all(channel == ChannelNoise() for channel in noise):
        return system
    lags = [(i, s, memory) for i, c in enumerate(noise) for s, memory in c.lags]
    channel = np.array([i for i, _, _ in lags], dtype=int)
    size = sigma[:, channel] * np.array([s for _, s, _ in lags])  # (L, lags)
    keep = np.exp(-h[..., None] / np.array([memory for _, _, memory in lags]))
    found = system.with_lags(keep, size)
    found.H[..., channel, np.arange(-len(lags), 0)] = 1.0
    R = system.R.copy()
    R[..., : len(noise)] *= np.array([c.white for c in noise]) ** 2
    return replace(found, R=R)


def simulated(system: System, draws: int, rng: np.random.Generator) -> Array:
    """Sensor noise (n, L, m, draws) as `system` describes it: white noise and lags."""
    sigma = np.sqrt(np.where(np.isfinite(system.R), system.R, 0.0))
    y = sigma[..., None] * rng.standard_normal((*sigma.shape, draws))
    if not system.lags:
        return np.asarray(y)
    own = slice(-system.lags, None)
    start = np.sqrt(np.diagonal(system.P0[:, own, own], axis1=1, axis2=2))
    drive = np.sqrt(np.diagonal(system.W[..., own, own], axis1=2, axis2=3))
    keep = np.diagonal(system.F[..., own, own], axis1=2, axis2=3)
    x = start[..., None] * rng.standard_normal((*start.shape, draws))
    for k in range(len(y)):
        y[k] += system.H[k][..., own] @ x
        x = keep[k][..., None] * x + drive[k][..., None] * rng.standard_normal(x.shape)
    return np.asarray(y)


# largest learnt noise, in sigmas that a sidecar states, and in those that were told from
# differences of rows: third differences show a tenth of AR(1) noise of 0.98 per row
STATED, GUESSED = 1.5, 10.0
DRAWS = 6  # simulated logs
WIDTH = 21  # nodes over which the power is averaged
LEAST = 0.02  # smallest power


def expected_power(system: System, gain: FilterGains) -> Array:
    """Mean square (n, L, m) of the whitened innovations that sensor noise alone makes.

    It is below 1 where the filter allows for contact forces that a steady stance does not need.
    The draws are few, so that their power is averaged over some nodes, those with a measurement.
    """
    y, known = simulated(system, DRAWS, np.random.default_rng(0)), np.isfinite(system.R)
    power = np.where(known, np.mean(innovations(system, gain, y, None) ** 2, axis=-1), 0.0)
    power, share = (uniform_filter1d(v, WIDTH, 0, float, "nearest") for v in (power, known))
    return np.asarray(np.maximum(power / np.maximum(share, 1.0 / WIDTH), LEAST))


def predicted_error(system: System, y: Array, g: Array, steps: int) -> Array:
    """y (n, L, m) minus its prediction, begun anew on the reference every so many steps.

    In the channels' units: how far the model's motion leaves the measured one in a window; `g`
    (n, L, j): accelerations of the first j channels of G.
    """
    n, runs, m, d = system.H.shape
    push = (system.G[..., : g.shape[2]] @ g[..., None])[..., 0]
    errors = np.empty((n, runs, m))
    x = np.zeros((runs, d))
    for k in range(n):
        if k % steps == 0:
            x = np.zeros((runs, d))
        errors[k] = y[k] - (system.H[k] @ x[..., None])[..., 0]
        x = (system.F[k] @ x[..., None])[..., 0] + push[k]
    return errors


def noise_behind(
    system: System,
    gain: FilterGains,
    errors: Array,
    batch: Batch,
    pushes: Sequence[Array],
    drifts: bool,
) -> tuple[ChannelNoise, ...]:
    """Noise of every channel, in units of its stated sigma; as stated where a correlation time is.

    `errors` (n, L, m): whitened errors of a flexible model, NaN where there is none. `pushes`:
    acceleration (n, L, k) per unit of every force that may be missing. `drifts`: slow drifts are
    looked for as well; only where the model is good, for what it lacks is slow, too.
    """
    settings, sigma, h = ColourSettings, batch.sigma, batch.h
    counts, channels = pairs(errors), sigma.shape[1]
    made: dict[Kind, Array] = {}
    memories = (0.0, *settings.memories, *(settings.drifts if drifts else ()))
    for channel in range(channels):
        draws = lag_noise(memories, h, settings.draws, np.random.default_rng(17 + channel))
        y = np.zeros((*h.shape, system.H.shape[2], len(memories) * settings.draws))
        y[:, :, channel] = sigma[:, channel, None] * draws.reshape(*h.shape, -1)
        parts = np.split(innovations(system, gain, y, None), len(memories), axis=-1)
        for memory, part in zip(memories, parts, strict=True):  # memory 0 is white
            made[channel, memory] = covariances(part, errors, counts)
    for i, push in enumerate(pushes, start=channels):
        force = lag_noise([settings.force], h, settings.draws, np.random.default_rng(5))
        seen = innovations(system, gain, None, np.asarray(push[..., None] * force))
        made[i, settings.force] = covariances(seen, errors, counts)
    found = learnt_noise(errors, counts, made, np.where(batch.stated, STATED, GUESSED))
    known = np.isfinite(batch.memory)
    return tuple(s if on else f for s, f, on in zip(stated_noise(batch), found, known, strict=True))


def stated_noise(batch: Batch) -> tuple[ChannelNoise, ...]:
    """The noise of each channel as the sidecars state it: white where they state no time."""
    white = ColourSettings.sharpest
    rest = float(np.sqrt(1.0 - white**2))
    return tuple(
        ChannelNoise(white, ((rest, float(memory)),)) if np.isfinite(memory) else ChannelNoise()
        for memory in batch.memory
    )


def with_drifts(noise: Noise, batch: Batch) -> tuple[ChannelNoise, ...]:
    """The noise of each channel with a drift of one stated sigma, where it has none and no
    correlation time is stated."""
    fastest, slowest = min(ColourSettings.drifts), max(ColourSettings.drifts)
    channels = noise or [ChannelNoise()] * len(batch.memory)

    def drifts(channel: ChannelNoise) -> bool:
        return any(memory >= fastest for _, memory in channel.lags)

    return tuple(
        c if drifts(c) or np.isfinite(memory) else replace(c, lags=(*c.lags, (1.0, slowest)))
        for c, memory in zip(channels, batch.memory, strict=True)
    )
