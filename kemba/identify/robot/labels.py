"""What each residual row of robot logs is: run, channel, time, phase, valve mode."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kemba.identify.problem.types import Array, Flags, Rows, Texts
from kemba.identify.robot.dynamics.physics import Physics
from kemba.identify.robot.dynamics.settings import PlaceSettings
from kemba.identify.robot.motion.batch import Batch
from kemba.identify.robot.motion.contact import ContactSchedule

MODES = np.array(["00", "01", "10", "11"], dtype=object)  # extend, retract


def row_channels(physics: Physics) -> tuple[str, ...]:
    """The measured channels, then the places of feet and stops that stand still."""
    feet = (f"{leg}/foot/{axis}" for leg in physics.legs for axis in "xz")
    return (*physics.channels, *feet, *(f"{leg}/stop" for leg in physics.legs))


def describe(
    physics: Physics,
    batch: Batch,
    schedules: Sequence[ContactSchedule],
    inputs: Array,
    mask: Flags,
    runs: Sequence[int],
) -> Rows:
    """Rows where `mask` (n, L, m) holds, run by run, channel by channel."""
    channels = row_channels(physics)
    m = len(channels)
    found: dict[str, list[Texts]] = {}
    for i in runs:
        log, own = batch.resampled[i], mask[:, i].T
        time = np.zeros(batch.n)
        time[: len(log.time)] = log.time
        phase = np.full(batch.n, "", dtype=object)
        phase[: len(log.time)] = schedules[i].phase
        sigma = np.append(log.sigma, [PlaceSettings.ground] * (m - len(log.sigma)))
        whole = {
            "run": np.full(own.shape, i),
            "channel": np.broadcast_to(np.arange(m)[:, None], own.shape),
            "time": np.broadcast_to(time, own.shape),
            "phase": np.broadcast_to(phase, own.shape),
            "mode": valve_modes(physics, inputs[:, i], channels).T,
            "sigma": np.broadcast_to(sigma[:, None], own.shape),
        }
        for key, values in whole.items():
            found.setdefault(key, []).append(values[own])
    joined = {key: np.concatenate(parts) for key, parts in found.items()}
    return Rows(channels=channels, **joined)  # type: ignore[arg-type]


def valve_modes(physics: Physics, inputs: Array, channels: Sequence[str]) -> Texts:
    """Mode (n, m) of the channel's own leg; of the body: the first leg's."""
    texts = {}
    for leg in physics.legs:
        on = [
            inputs[:, physics.inputs.index(f"{leg}/valve/{side}")] > 0.5
            for side in ("extend", "retract")
        ]
        texts[leg] = MODES[2 * on[0].astype(int) + on[1]]
    first = physics.legs[0]
    return np.stack([texts.get(c.split("/")[0], texts[first]) for c in channels], axis=1)
