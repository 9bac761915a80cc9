"""The symbolic dynamics against Pinocchio's numeric algorithms on the opened tree."""

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest
from oracle.robots import NAMES, Case, case

RELATIVE = 1e-10
SEEDS = range(12)


@pytest.fixture(params=NAMES)
def robot(request: pytest.FixtureRequest) -> Case:
    return case(request.param)


@pytest.mark.parametrize("seed", SEEDS)
def test_inverse_dynamics_is_rnea_projected(robot: Case, seed: int) -> None:
    q, v, a = robot.state(seed)
    q_tree, phi, v_tree, a_tree = robot.open(q, v, a)
    torque = pin.rnea(robot.tree, robot.tree.createData(), q_tree, v_tree, a_tree)
    ours = np.array(robot.inverse_dynamics(q, v, a)).ravel()
    assert ours == pytest.approx(phi.T @ torque, rel=RELATIVE, abs=RELATIVE * abs(ours).max())


@pytest.mark.parametrize("seed", SEEDS)
def test_mass_matrix_is_crba_projected(robot: Case, seed: int) -> None:
    q, v, a = robot.state(seed)
    q_tree, phi, *_ = robot.open(q, v, a)
    upper = np.triu(pin.crba(robot.tree, robot.tree.createData(), q_tree))
    theirs = phi.T @ (upper + np.triu(upper, 1).T) @ phi
    m = robot.mechanism
    ours = np.array(ca.Function("M", [m.q], [ca.jacobian(m.inverse_dynamics, m.a)])(q))
    assert ours == pytest.approx(theirs, rel=RELATIVE, abs=RELATIVE * abs(theirs).max())
    assert ours == pytest.approx(ours.T, rel=RELATIVE)
    assert np.linalg.eigvalsh(ours).min() > 0


@pytest.mark.parametrize("seed", SEEDS)
def test_the_loop_is_closed(robot: Case, seed: int) -> None:
    """The rod's pin and the tibia's are one place; where they are, the ports say too."""
    q, v, a = robot.state(seed)
    data = robot.tree.createData()
    pin.forwardKinematics(robot.tree, data, robot.open(q, v, a)[0])
    m, leg = robot.mechanism, robot.robot.leg
    points = ca.Function("points", [m.q], list(m.points.values()))(q)
    places = dict(zip(m.points, (np.array(p).ravel() for p in points), strict=True))
    for name in robot.robot.legs:
        rod = data.oMi[robot.tree.getJointId(f"{name}/rod")].translation
        tibia = data.oMi[robot.tree.getJointId(f"{name}/knee")]
        pinned = tibia.act(np.array([0.0, 0.0, -leg.piston.pin]))
        foot = tibia.act(np.array([0.0, 0.0, -leg.tibia.length]))
        assert rod == pytest.approx(pinned, abs=1e-12)
        assert places[f"{name}/pin"] == pytest.approx(pinned[[0, 2]], abs=1e-12)
        assert places[f"{name}/foot"] == pytest.approx(foot[[0, 2]], abs=1e-12)
        assert rod[1] == 0.0, "the plane is left"


def test_a_turned_joint_is_refused() -> None:
    from kemba.mechanism.recursion import read_joints

    model = pin.Model()
    model.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "roll")
    with pytest.raises(ValueError, match="joint roll leaves the x-z plane"):
        read_joints(model)
