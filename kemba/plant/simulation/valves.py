"""From valve commands as sent to what the valves do: dead time, late closing, merged pulses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kemba.model import Model
from kemba.plant.simulation.commands import Profile
from kemba.trajectory import Trajectory


def acting(sent: Profile, on: float, off: float) -> Profile:
    """The profile of a 0/1 valve that opens `on` and closes `off` [s] after the command.

    Pulses that overlap after the shift merge; those that vanish are dropped. A valve that is on
    before the first command stays on until its first closing.
    """
    merged: list[list[float]] = []
    for start, end in _pulses(sent):
        start, end = start + on, end + off
        if end <= start:
            continue
        if merged and start <= merged[-1][1]:
            merged[-1][1] = max(merged[-1][1], end)
        else:
            merged.append([start, end])
    return Profile.pulses(*((a, b) for a, b in merged))


def delayed(model: Model, profiles: dict[str, Profile]) -> dict[str, Profile]:
    """The profiles with every valve's switching times of the model applied."""
    late = dict(profiles)
    for (leg, _), quantity in model.inputs.items():
        if quantity.binary and quantity.name in profiles:
            late[quantity.name] = acting(profiles[quantity.name], *model.timing(leg))
    return late


def scattered(
    model: Model, table: Trajectory, sigma: float, rng: np.random.Generator
) -> dict[str, Profile]:
    """The valve commands of a controller table, every switching moved by chance (`sigma` [s])."""
    moved = {}
    for quantity in model.inputs.values():
        if quantity.binary:
            profile = Profile.of(table.time, table[quantity.name])
            times = profile.times.copy()
            times[1:] += rng.normal(0.0, sigma, len(times) - 1)
            moved[quantity.name] = replace(profile, times=np.maximum.accumulate(times))
    return moved


def _pulses(sent: Profile) -> list[tuple[float, float]]:
    on = sent.values > 0.5
    edges = np.flatnonzero(np.diff(on.astype(int))) + 1
    starts = [-np.inf] * bool(on[0]) + [float(sent.times[i]) for i in edges if on[i]]
    ends = [float(sent.times[i]) for i in edges if not on[i]]
    return list(zip(starts, ends + [np.inf] * (len(starts) - len(ends)), strict=True))
