"""What each residual row of robot logs is, and where its piston was."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from kemba.effects.pneumatics.flow import ATMOSPHERE
from kemba.effects.pneumatics.switching import changes as switchings
from kemba.identify.problem.types import Array, Changes, OperatingPoint, Rows, Texts
from kemba.identify.robot.batch import ResampledLog
from kemba.identify.robot.physics import Physics
from kemba.identify.robot.reference import PlaceSettings
from kemba.identify.robot.state import LinearisedState
from kemba.mechanism import Cylinder

MODES = np.array(["00", "01", "10", "11"], dtype=object)  # extend, retract


def _row_channels(physics: Physics) -> tuple[str, ...]:
    """The measured channels, then the places of feet and stops that stand still."""
    feet = (f"{leg}/foot/{axis}" for leg in physics.legs for axis in "xz")
    return (*physics.channels, *feet, *(f"{leg}/stop" for leg in physics.legs))


def describe(state: LinearisedState) -> Rows:
    """Rows of the logs that are data, run by run, channel by channel."""
    physics, batch, inputs = state.physics, state.batch, state.motion.states[1]
    channels = _row_channels(physics)
    m = len(channels)
    found: dict[str, list[Texts]] = {}
    for i, log in enumerate(batch.resampled):
        own = state.mask[:, i].T
        time = np.zeros(batch.n)
        time[: len(log.time)] = log.time
        phase = np.full(batch.n, "", dtype=object)
        phase[: len(log.time)] = state.schedules[i].phase
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


def _air_force(states: Mapping[str, Array], cylinder: Cylinder, prefix: str = "") -> Array:
    """Push of the air on a rod [N] from the chambers' states by name, in force or in pressure."""
    push = []
    areas = {"extend": cylinder.area_extend, "retract": cylinder.area_retract}
    for chamber, area in areas.items():
        name = f"{prefix}chamber/{chamber}/"
        known = states.get(f"{name}F")
        push.append((states[f"{name}P"] - ATMOSPHERE) * area if known is None else known)
    return np.asarray(push[0] - push[1])


SIDES = ("extend", "retract")


def robot_operating_point(state: LinearisedState) -> OperatingPoint:
    """The pistons along the motion on which the model was linearised."""
    legs, motion = state.physics.legs, state.motion
    pistons = slice(motion.y.shape[-1] - len(legs), None)
    place = (motion.y[..., pistons], motion.rate[..., pistons], air_forces(state))
    per_leg = np.moveaxis(np.stack(place, axis=-1), 2, 0)  # (legs, n, L, 3)
    owners = [channel.split("/")[0] for channel in _row_channels(state.physics)]
    own = [per_leg[legs.index(o) if o in legs else 0] for o in owners]
    x, v, force = state.pick(np.stack(own, axis=2)).T
    return OperatingPoint(x, v, force, state.physics.mechanism.need_cylinder().stroke)


def air_forces(state: LinearisedState) -> Array:
    """Push of the model's air [N] on every leg's rod (n, L, legs)."""
    names = [q.name for q in state.physics.model.states.values()]
    states = dict(zip(names, np.moveaxis(state.motion.states[0], -1, 0), strict=True))
    cylinder, legs = state.physics.mechanism.need_cylinder(), state.physics.legs
    return np.stack([_air_force(states, cylinder, f"{leg}/") for leg in legs], axis=-1)


def changes(log: ResampledLog, legs: Sequence[str]) -> Changes:
    """Command -> times [s] and sizes of its changes in one run: valves, then hip torques [N.m]."""
    valves = [f"{leg}/valve/{side}" for leg in legs for side in SIDES]
    found = {name: switchings(sent) for name, sent in zip(valves, log.sent, strict=True)}
    steps = np.diff(log.torque, axis=0)
    for i, leg in enumerate(legs):
        found[f"{leg}/hip/tau"] = (log.time[1:], steps[:, i])
    return found
