"""Where the pistons of robot logs are, row by row."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kemba.effects.pneumatics.switching import changes as switchings
from kemba.identify.problem.operating_point import air_force
from kemba.identify.problem.types import Array, Changes, OperatingPoint
from kemba.identify.robot.labels import row_channels
from kemba.identify.robot.motion.resampled import ResampledLog
from kemba.identify.robot.state import LinearisedState

SIDES = ("extend", "retract")


def robot_operating_point(state: LinearisedState) -> OperatingPoint:
    """The pistons along the motion on which the model was linearised."""
    legs, motion = state.physics.legs, state.motion
    pistons = slice(motion.y.shape[-1] - len(legs), None)
    place = (motion.y[..., pistons], motion.rate[..., pistons], air_forces(state))
    per_leg = np.moveaxis(np.stack(place, axis=-1), 2, 0)  # (legs, n, L, 3)
    owners = [channel.split("/")[0] for channel in row_channels(state.physics)]
    own = [per_leg[legs.index(o) if o in legs else 0] for o in owners]
    x, v, force = state.pick(np.stack(own, axis=2)).T
    return OperatingPoint(x, v, force, state.physics.mechanism.need_cylinder().stroke)


def air_forces(state: LinearisedState) -> Array:
    """Push of the model's air [N] on every leg's rod (n, L, legs)."""
    names = [q.name for q in state.physics.model.states.values()]
    states = dict(zip(names, np.moveaxis(state.motion.states[0], -1, 0), strict=True))
    cylinder, legs = state.physics.mechanism.need_cylinder(), state.physics.legs
    return np.stack([air_force(states, cylinder, f"{leg}/") for leg in legs], axis=-1)


def changes(log: ResampledLog, legs: Sequence[str]) -> Changes:
    """Command -> times [s] and sizes of its changes in one run: valves, then hip torques [N.m]."""
    valves = [f"{leg}/valve/{side}" for leg in legs for side in SIDES]
    found = {name: switchings(sent) for name, sent in zip(valves, log.sent, strict=True)}
    steps = np.diff(log.torque, axis=0)
    for i, leg in enumerate(legs):
        found[f"{leg}/hip/tau"] = (log.time[1:], steps[:, i])
    return found
