"""The colour of the sensors' noise, learnt from the filter's errors.

Missing forces are kinds of noise, too, so that what a model lacks is not taken for the noise of a
sensor.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kemba.identify.problem.sensor_noise import (
    ChannelNoise,
    ColourSettings,
    Kind,
    chosen_noise,
    covariances,
    lag_noise,
    pairs,
    weighted,
)
from kemba.identify.problem.types import Array
from kemba.identify.robot.motion.filter import FilterGains, System, innovations


def learnt_noise(
    system: System,
    gain: FilterGains,
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
    settings, channels = ColourSettings, sigma.shape[1]
    counts = pairs(errors)
    measured = covariances(errors[..., None], errors, counts)
    known = counts[:channels, 0] >= settings.fewest
    if not known.any():
        return tuple(ChannelNoise() for _ in range(channels))
    kinds: list[Kind] = []
    columns: list[Array] = []
    memories = (0.0, *settings.memories, *(settings.drifts if drifts else ()))
    m = system.H.shape[2]
    for channel in range(channels):
        y = np.concatenate([_channel_noise(t, channel, sigma, h, m) for t in memories], axis=-1)
        seen = innovations(system, gain, y, None)
        parts = np.split(seen, len(memories), axis=-1)
        columns += [covariances(part, errors, counts) for part in parts]
        kinds += [Kind(channel, memory) for memory in memories]
    for i, push in enumerate(pushes):
        seen = innovations(system, gain, None, _force_noise(settings.force, push, h))
        columns.append(covariances(seen, errors, counts))
        kinds.append(Kind(channels + i, settings.force))
    return chosen_noise(*weighted(columns, measured, counts), kinds, most, known)


def _channel_noise(memory: float, channel: int, sigma: Array, h: Array, m: int) -> Array:
    """Noise (n, L, m, draws) of one channel, of one stated sigma; `memory` [s]: 0 is white."""
    draws = ColourSettings.draws
    rng = np.random.default_rng(17 + channel)
    y = np.zeros((*h.shape, m, draws))
    y[:, :, channel] = sigma[:, channel, None] * lag_noise(memory, h, draws, rng)
    return y


def _force_noise(memory: float, push: Array, h: Array) -> Array:
    """Accelerations (n, L, k, draws) of one force of unit sigma."""
    draws = ColourSettings.draws
    force = lag_noise(memory, h, draws, np.random.default_rng(5))
    return np.asarray(push[..., None] * force[:, :, None])
