"""Noise of a robot's sensors: white noise and lags as states of the filter, stated or learnt.

A first-order lag of white noise is AR(1) noise: an exponential memory. The sum of white noise and
two lags also describes quantised channels and slow drift. It keeps its meaning where rows are
missing or nodes are not evenly spaced, which an AR model of rows does not. Where the noise is
learnt from the filter's errors, missing forces are kinds of noise, too, so that what a model lacks
is not taken for the noise of a sensor.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kemba.identify.problem.problem import Array
from kemba.identify.problem.sensor_noise import (
    ChannelNoise,
    ColourSettings,
    Kind,
    covariances,
    lag_noise,
    learnt_noise,
    pairs,
)
from kemba.identify.robot.batch import Batch
from kemba.identify.robot.filter import FilterGains, System, innovations

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
WIDTH = 21  # nodes over which the power is averaged; odd
LEAST = 0.02  # smallest power


def expected_power(system: System, gain: FilterGains) -> Array:
    """Mean square (n, L, m) of the whitened innovations that sensor noise alone makes.

    It is below 1 where the filter allows for contact forces that a steady stance does not need.
    The draws are few, so that their power is averaged over some nodes.
    """
    rng = np.random.default_rng(0)
    y = simulated(system, DRAWS, rng)
    power = np.mean(innovations(system, gain, y, None) ** 2, axis=-1)
    padded = np.pad(power, ((WIDTH // 2, WIDTH // 2), (0, 0), (0, 0)), mode="edge")
    total = np.cumsum(padded, axis=0)
    total = np.concatenate([np.zeros((1, *total.shape[1:])), total])
    return np.asarray(np.maximum((total[WIDTH:] - total[:-WIDTH]) / WIDTH, LEAST))


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
            made[Kind(channel, memory)] = covariances(part, errors, counts)
    for i, push in enumerate(pushes, start=channels):
        force = lag_noise([settings.force], h, settings.draws, np.random.default_rng(5))
        seen = innovations(system, gain, None, np.asarray(push[..., None] * force))
        made[Kind(i, settings.force)] = covariances(seen, errors, counts)
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
