"""Ports of robot logs: forces on rods, hips and body as columns of whitened residuals."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from kemba.identify.compare.force_profiles import lags, risen
from kemba.identify.evidence.operating_point import air_force
from kemba.identify.evidence.problem import Array, Flags, ForceChannel
from kemba.identify.robot.motion.filter import innovations
from kemba.identify.robot.operating_point import SIDES

if TYPE_CHECKING:
    from kemba.identify.robot.problem import RobotProblem

BODY = {"body z": 1, "body x": 0}  # place among the channels


def robot_ports(problem: RobotProblem) -> list[ForceChannel]:
    """Rods and hips (both legs share a law), then the body along z and x.

    A force is looked for where it shows: of hips and body in flight, of rods off their stops.
    """
    flight = problem.batch.pad([(s.phase == "flight").astype(float) for s in problem.plan], 0.0)
    y, rate, where = problem.point.y, problem.point.rate, flight[..., None] > 0.5
    found = [_rods(problem), _hips(problem, where)]
    for name, k in BODY.items():
        quantities = {
            "speed [m/s]": np.where(where, rate[..., [k]], np.nan),
            "position [m]": np.where(where, y[..., [k]], np.nan),
        }
        found.append(ForceChannel(name, "N", 3.0, quantities, port_columns(problem, [k])))
    return found


def _rods(problem: RobotProblem) -> ForceChannel:
    physics, point, batch = problem.physics, problem.point, problem.batch
    legs = len(physics.legs)
    names = [q.name for q in physics.model.states.values()]
    states = dict(zip(names, np.moveaxis(point.states[0], -1, 0), strict=True))
    air = np.stack([air_force(states, f"{leg}/") for leg in physics.legs], axis=-1)
    stopped = batch.pad([(s.low | s.high).astype(float) for s in problem.plan], 1.0)
    where = (stopped < 0.5) & batch.valid[..., None]
    quantities = {
        "speed [m/s]": point.rate[..., 3 + legs :],
        "position [mm]": 1e3 * point.y[..., 3 + legs :],
        "air force [N]": air,
    }
    return ForceChannel(
        "rods",
        "N",
        10.0,
        {label: np.where(where, values, np.nan) for label, values in quantities.items()},
        port_columns(problem, range(3 + legs, 3 + 2 * legs)),
        {side: _after(problem, f"valve/{side}") for side in SIDES},
    )


def _hips(problem: RobotProblem, where: Flags) -> ForceChannel:
    legs = range(3, 3 + len(problem.physics.legs))
    torque = problem.batch.pad([t.torque for t in problem.batch.resampled], 0.0)
    quantities = {
        "speed [rad/s]": problem.point.rate[..., legs],
        "angle [rad]": problem.point.y[..., legs],
        "torque [N.m]": torque,
    }
    return ForceChannel(
        "hips",
        "N.m",
        0.5,
        {label: np.where(where, values, np.nan) for label, values in quantities.items()},
        port_columns(problem, legs),
        {"hip/tau": _after(problem, "hip/tau")},
    )


def _after(problem: RobotProblem, command: str) -> Array:
    """How much each leg's own command rose before every node, (n, L, legs, lags)."""
    runs = []
    for sent, track in zip(problem.commands(), problem.batch.resampled, strict=True):
        own = [risen(*sent[f"{leg}/{command}"], track.time) for leg in problem.physics.legs]
        runs.append(np.stack(own, axis=1).reshape(len(track.time), -1))
    return problem.batch.pad(runs, 0.0).reshape(*problem.batch.valid.shape, -1, len(lags()) - 1)


def port_columns(problem: RobotProblem, channels: Sequence[int]) -> Callable[[Array], Array]:
    """Columns of residual for forces (n, L, ports, b) on these channels."""
    point = problem.point

    def columns(force: Array) -> Array:
        pushes = point.inverse @ point.channels[..., list(channels)]
        g = np.einsum("nlkp,nlpb->nlkb", pushes, force)
        y = np.zeros((*point.system.R.shape, force.shape[-1]))
        _, errors = innovations(point.system, problem.gain, y, point.extend(g))
        return problem.pick(-(problem.gain.whitener @ errors))

    return columns
