"""Force channels of robot logs: rods, hips and body, as columns of whitened residuals."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from kemba.identify.compare.force_profiles import lags, risen
from kemba.identify.problem.types import Array, Flags, ForceChannel
from kemba.identify.robot.operating_point import SIDES, air_forces, changes
from kemba.identify.robot.state import LinearisedState

BODY = {"body z": 1, "body x": 0}  # place among the channels


class UsualForceSettings:
    """A force of each channel that is neither small nor large."""

    body = 3.0  # on the body [N]
    hip = 0.5  # at a hip [N.m]
    rod = 10.0  # on a rod [N]: friction of 6 to 8 N by the paper's tables


def robot_force_channels(state: LinearisedState) -> list[ForceChannel]:
    """Rods and hips (both legs share a force profile), then the body along z and x.

    A force is looked for where it shows: of hips and body in flight, of rods off their stops.
    """
    flying = [(s.phase == "flight").astype(float) for s in state.schedules]
    where = state.batch.pad(flying, 0.0)[..., None] > 0.5
    y, rate = state.motion.y, state.motion.rate
    usual = UsualForceSettings
    found = [_rods(state), _hips(state, where)]
    for name, k in BODY.items():
        quantities = {
            "speed [m/s]": np.where(where, rate[..., [k]], np.nan),
            "position [m]": np.where(where, y[..., [k]], np.nan),
        }
        found.append(ForceChannel(name, "N", usual.body, quantities, force_columns(state, [k])))
    return found


def _rods(state: LinearisedState) -> ForceChannel:
    motion, batch, legs = state.motion, state.batch, len(state.physics.legs)
    stopped = batch.pad([(s.low | s.high).astype(float) for s in state.schedules], 1.0)
    where = (stopped < 0.5) & batch.valid[..., None]
    quantities = {
        "speed [m/s]": motion.rate[..., 3 + legs :],
        "position [mm]": 1e3 * motion.y[..., 3 + legs :],
        "air force [N]": air_forces(state),
    }
    return ForceChannel(
        "rods",
        "N",
        UsualForceSettings.rod,
        {label: np.where(where, values, np.nan) for label, values in quantities.items()},
        force_columns(state, range(3 + legs, 3 + 2 * legs)),
        {side: _after(state, f"valve/{side}") for side in SIDES},
    )


def _hips(state: LinearisedState, where: Flags) -> ForceChannel:
    legs = range(3, 3 + len(state.physics.legs))
    quantities = {
        "speed [rad/s]": state.motion.rate[..., legs],
        "angle [rad]": state.motion.y[..., legs],
        "torque [N.m]": state.batch.torque,
    }
    return ForceChannel(
        "hips",
        "N.m",
        UsualForceSettings.hip,
        {label: np.where(where, values, np.nan) for label, values in quantities.items()},
        force_columns(state, legs),
        {"hip/tau": _after(state, "hip/tau")},
    )


def _after(state: LinearisedState, command: str) -> Array:
    """How much each leg's own command rose before every node, (n, L, legs, lags)."""
    batch, legs = state.batch, state.physics.legs
    runs = []
    for log in batch.resampled:
        sent = changes(log, legs)
        own = [risen(*sent[f"{leg}/{command}"], log.time) for leg in legs]
        runs.append(np.stack(own, axis=1).reshape(len(log.time), -1))
    return batch.pad(runs, 0.0).reshape(*batch.valid.shape, -1, len(lags()) - 1)


def force_columns(state: LinearisedState, channels: Sequence[int]) -> Callable[[Array], Array]:
    """Function from forces (n, L, ports, b) on these channels to columns (rows, b) of residual."""
    motion = state.motion

    def columns(force: Array) -> Array:
        pushes = motion.inverse @ motion.channels[..., list(channels)]
        return state.pick(state.pushed(np.einsum("nlkp,nlpb->nlkb", pushes, force)))

    return columns
