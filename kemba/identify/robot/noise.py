"""Noise of a robot's sensors: as the sidecar states it, or learnt from what a model leaves over."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kemba.identify.problem.sensor_noise import ChannelNoise, ColourSettings
from kemba.identify.problem.types import Array
from kemba.identify.robot.motion.batch import Batch
from kemba.identify.robot.motion.colour import Noise
from kemba.identify.robot.motion.learnt import learnt_noise
from kemba.identify.robot.state import LinearisedState


class SensorNoiseSettings:
    """How far learnt noise may differ from what was known before."""

    stated = 1.5  # largest learnt noise, in sigmas that a sidecar states
    # the same, in sigmas that were told from differences of rows: third differences show a tenth of
    # AR(1) noise of 0.98 per row
    guessed = 10.0


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


def learnt_from(state: LinearisedState, left: Array, drifts: bool) -> tuple[ChannelNoise, ...]:
    """The noise of each channel, learnt from the rows `left` (rows,) that a flexible model leaves;
    as stated where a correlation time is stated. `drifts`: slow drifts are looked for, too."""
    motion, batch, settings = state.motion, state.batch, SensorNoiseSettings
    k = motion.ref.q.shape[2]
    pushed = motion.inverse @ motion.channels[..., :k]
    most = np.where(batch.stated, settings.stated, settings.guessed)
    found = learnt_noise(
        motion.system,
        state.gain,
        state.spread(left),
        batch.sigma,
        batch.h,
        [pushed[..., i] for i in range(k)],
        most,
        drifts,
    )
    stated = stated_noise(batch)
    known = np.isfinite(batch.memory)
    return tuple(s if on else f for s, f, on in zip(stated, found, known, strict=True))
