"""Valve commands as they reach a simulated model: dead time, late closing, scatter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kemba.effects.pneumatics import switching
from kemba.model import Model
from kemba.plant.simulation.commands import Profile
from kemba.trajectory import Trajectory


def acting(sent: Profile, on: float, off: float) -> Profile:
    """The profile of a 0/1 valve that opens `on` and closes `off` [s] after the command.

    Pulses that overlap after the shift merge; those that vanish are dropped. A valve that is on
    before the first command stays on until its first closing.
    """
    late = switching.delayed(switching.pulses(sent.times, sent.values), on, off)
    return Profile.pulses(*((a, b) for a, b in late.tolist()))


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
            profile = Profile.of(table.time, table[quantity.name]).from_closed()
            times = profile.times.copy()
            times[1:] += rng.normal(0.0, sigma, len(times) - 1)
            moved[quantity.name] = replace(profile, times=np.maximum.accumulate(times))
    return moved
