"""The robot's published numbers, as the mechanism has them."""

import casadi as ca
import numpy as np
import pytest

from kemba.mechanism import load_robot, robot_mechanism
from kemba.mechanism.knee import flexion
from kemba.mechanism.robot import standing_pose
from kemba.model import load_model

ROBOT = load_robot("kemba")


def test_masses() -> None:
    mechanism = robot_mechanism(load_robot("kemba"))
    assert mechanism.mass == pytest.approx(4.476)
    assert mechanism.weight == pytest.approx(4.476 * 9.81)
    assert mechanism.body_mass == 2.886


def test_knee_range() -> None:
    assert flexion(ROBOT.leg, 0.0) == pytest.approx(2.42837, abs=1e-5)
    assert flexion(ROBOT.leg, ROBOT.stroke) == pytest.approx(0.79302, abs=1e-5)


def test_leg_length_and_pose() -> None:
    """The leg reaches from 0.166 to 0.44 m as its piston extends."""
    retracted, extended = standing_pose(ROBOT, 0.0), standing_pose(ROBOT, 0.07)
    assert retracted["body/z"] == pytest.approx(0.166, abs=5e-4)
    assert extended["body/z"] == pytest.approx(0.44, abs=1e-3)
    assert retracted["front/knee/q"] > 0 > retracted["rear/knee/q"]
    assert retracted["front/hip/q"] == -retracted["rear/hip/q"]


def test_free_fall_with_the_boom() -> None:
    """With its joints held, the robot falls with 10.7 m/s2: the boom is heavy for its inertia."""
    model = load_model()
    m = model.mechanism
    node = model.node
    q = [m.standing[c.name] for c in m.coordinates]
    zeros = {name: np.zeros(getattr(node, name).numel()) for name in node.NAMES}
    a = ca.SX.sym("a")
    falling = ca.vertcat(0, a, *[0] * (m.n - 2))
    force = node.residual(**{**zeros, "q": q, "a": falling})["dynamics"][1]
    fall = ca.Function("fall", [a], [force, ca.jacobian(force, a)])
    value, slope = (float(part) for part in fall(0.0))
    assert value / slope == pytest.approx(10.7, abs=0.05)
    assert slope == pytest.approx(4.476 + 0.776, abs=1e-3)
    assert value == pytest.approx(4.476 * 9.81 + 12.2, abs=0.01)
