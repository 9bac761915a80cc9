"""A made-up jump that looks like a plan: level body, both legs alike, ballistic flight."""

from collections.abc import Callable

import numpy as np
import pytest

from kemba.effects.pneumatics.chamber import Chamber
from kemba.mechanism import load_robot
from kemba.mechanism.robot import standing_pose
from kemba.plotting.source import Machine, Source, load_machine
from kemba.trajectory import Array, Trajectory

TAKEOFF, LANDING, END = 0.20, 0.49, 0.70  # s
GRAVITY = 10.7  # m.s-2, with the boom


def made_up_jump(nodes: int = 101, sway: float = 0.0) -> Trajectory:
    """Nodes of a jump and land with every column of the robot log; `sway` [rad] of pitch."""
    time = np.linspace(0.0, END, nodes) + 0.001 * np.sin(np.arange(nodes))
    time[0] = 0.0
    x = 0.07 * np.clip(_ramp(time, 0.04, TAKEOFF) - _ramp(time, LANDING, END - 0.03), 0, 1)
    robot = load_robot("kemba")
    standing = [standing_pose(robot, float(value)) for value in x]
    flight = np.clip((time - TAKEOFF) * (LANDING - time) * GRAVITY / 2, 0, None)
    columns = {
        "body/x [m]": np.zeros(nodes),
        "body/z [m]": np.array([pose["body/z"] for pose in standing]) + flight,
        "body/pitch [rad]": sway * np.sin(np.pi * time / END),
    }
    ground = (time <= TAKEOFF) | (time > LANDING)
    for leg, side in (("front", 1.0), ("rear", -1.0)):
        columns |= _leg(leg, side, time, x, ground)
        for joint in ("hip", "knee"):
            name = f"{leg}/{joint}/q"
            columns[f"{name} [rad]"] = np.array([pose[name] for pose in standing])
    return Trajectory(time, columns, {"kind": "plan"})


MEASURED = ("body/", "hip/", "piston/x", "valve/")


@pytest.fixture(scope="session")
def jump() -> Callable[..., Trajectory]:
    """`jump(nodes, sway)`: the made-up jump."""
    return made_up_jump


@pytest.fixture(scope="session")
def plan() -> Source:
    """The jump as a plan."""
    return Source("plan", made_up_jump(), plan=True)


@pytest.fixture(scope="session")
def log() -> Source:
    """The jump as a log with the columns that are always measured."""
    whole = made_up_jump(351, 0.05)
    measured = whole.select(n for n in whole.names if any(part in n for part in MEASURED))
    measured.meta = {"kind": "robot"}
    return Source("log", measured)


@pytest.fixture(scope="session")
def machine() -> Machine:
    """The shipped robot."""
    return load_machine()


def _ramp(time: Array, start: float, end: float) -> Array:
    """0 before `start`, 1 after `end`, with a level start and end in between."""
    share = np.clip((time - start) / (end - start), 0, 1)
    return share**2 * (3 - 2 * share)


def _leg(leg: str, side: float, time: Array, x: Array, ground: Array) -> dict[str, Array]:
    extend = ((time > 0.02) & (time < 0.13)) | (time > LANDING + 0.05)
    retract = (time > TAKEOFF + 0.05) & (time < TAKEOFF + 0.12)
    push, pull = _lag(time, 324.0 * extend), _lag(time, 260.0 * retract)
    damping = 25 * (1 + extend + retract) * np.gradient(x, time)
    return {
        f"{leg}/hip/tau [N.m]": side * 6 * np.sin(9 * time) * ground,
        f"{leg}/piston/x [m]": x,
        f"{leg}/valve/extend [1]": extend.astype(float),
        f"{leg}/valve/retract [1]": retract.astype(float),
        f"{leg}/chamber/extend/F [N]": push,
        f"{leg}/chamber/retract/F [N]": pull,
        f"{leg}/piston/F [N]": push - pull - damping,
        f"{leg}/foot/Fz [N]": ground * (25 + 0.25 * push),
        f"{leg}/foot/Fx [N]": side * ground * (2 + 0.02 * push),
    }


def _lag(time: Array, target: Array) -> Array:
    """First-order answer to `target` by implicit Euler, as the planner has it."""
    force = np.zeros(len(time))
    for k in range(1, len(time)):
        share = (time[k] - time[k - 1]) / Chamber().of_cylinder(load_robot("kemba").cylinder).vent[
            1
        ]
        force[k] = (force[k - 1] + share * target[k]) / (1 + share)
    return force
