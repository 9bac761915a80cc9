"""Where the pistons of robot logs are, row by row."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from kemba.effects.pneumatics.switching import changes as switchings
from kemba.identify.evidence.operating_point import OperatingPoint, air_force
from kemba.identify.evidence.problem import Array
from kemba.identify.robot.labels import row_channels
from kemba.identify.robot.motion.resampled import ResampledLog

if TYPE_CHECKING:
    from kemba.identify.robot.problem import RobotProblem

SIDES = ("extend", "retract")


def robot_operating_point(problem: RobotProblem) -> OperatingPoint:
    """The pistons along the motion on which the problem was linearised."""
    physics, point = problem.physics, problem.point
    names = [q.name for q in physics.model.states.values()]
    states = dict(zip(names, np.moveaxis(point.states[0], -1, 0), strict=True))
    legs = physics.legs
    per_leg = []
    for i, leg in enumerate(legs):
        place = point.y.shape[-1] - len(legs) + i
        x, v = point.y[..., place], point.rate[..., place]
        per_leg.append(np.stack([x, v, air_force(states, f"{leg}/")], axis=-1))
    owners = [channel.split("/")[0] for channel in row_channels(physics)]
    own = [per_leg[legs.index(o) if o in legs else 0] for o in owners]
    picked = problem.pick(np.stack(own, axis=2))
    x, v, force = picked.T
    return OperatingPoint(x, v, force, float(physics.mechanism.stroke))


def changes(track: ResampledLog, legs: Sequence[str]) -> dict[str, tuple[Array, Array]]:
    """Command -> times and sizes of its changes in one run: valves, then hip torques [N.m]."""
    valves = [f"{leg}/valve/{side}" for leg in legs for side in SIDES]
    found = {name: switchings(sent) for name, sent in zip(valves, track.sent, strict=True)}
    steps = np.diff(track.torque, axis=0)
    for i, leg in enumerate(legs):
        found[f"{leg}/hip/tau"] = (track.time[1:], steps[:, i])
    return found
