"""Ports: velocity, acceleration and effort by automatic differentiation, against differences."""

import casadi as ca
import numpy as np
import pytest

from kemba.errors import KembaError
from kemba.mechanism import Mechanism, load_cylinder, load_robot, rig_mechanism, robot_mechanism


@pytest.fixture(scope="module")
def robot() -> Mechanism:
    return robot_mechanism(load_robot("kemba"))


def point(m: Mechanism) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A pose off the standing one, with rates and accelerations."""
    rng = np.random.default_rng(3)
    q = np.array([m.standing[c.name] for c in m.coordinates])
    return q - 0.1 * np.sign(q), rng.normal(size=m.n), rng.normal(size=m.n)


def test_every_port_moves_as_its_position_does(robot: Mechanism) -> None:
    m = robot
    motions = [ca.vertcat(*m.motion(name)) for name in m.ports]
    f = ca.Function("f", [m.q, m.v, m.a], [ca.horzcat(*motions)])
    q, v, a = point(m)
    step = 1e-5

    def at(t: float) -> np.ndarray:
        return np.array(f(q + v * t + 0.5 * a * t**2, v + a * t, a))

    before, here, after = at(-step), at(0.0), at(step)
    assert here[1] == pytest.approx((after[0] - before[0]) / (2 * step), abs=1e-7)
    assert here[2] == pytest.approx((after[1] - before[1]) / (2 * step), abs=1e-7)


def test_an_effort_works_on_its_port(robot: Mechanism) -> None:
    """Power of the generalised force equals effort times port velocity (virtual work)."""
    m = robot
    efforts = {name: ca.SX(float(i + 1)) for i, name in enumerate(m.ports)}
    power = ca.dot(m.generalised(efforts), m.v)
    at_ports = sum(e * m.motion(name)[1] for name, e in efforts.items())
    f = ca.Function("f", [m.q, m.v], [power, at_ports])
    left, right = f(*point(m)[:2])
    assert float(left) == pytest.approx(float(right), rel=1e-12)
    assert m.generalised({}).is_zero()


def test_standing_pose(robot: Mechanism) -> None:
    m = robot
    q = [m.standing[c.name] for c in m.coordinates]
    at = ca.Function("at", [m.q], [ca.vertcat(*(p.phi for p in m.ports.values()))])
    places = dict(zip(m.ports, np.array(at(q)).ravel(), strict=True))
    for leg in m.legs:
        assert places[f"{leg}/foot/z"] == pytest.approx(0.0, abs=1e-15)
        assert places[f"{leg}/piston/x"] == pytest.approx(0.0, abs=1e-15)
        assert places[f"{leg}/foot/x"] == pytest.approx(places[f"{leg}/hip/x"])


def test_an_unknown_port_is_explained(robot: Mechanism) -> None:
    with pytest.raises(KembaError) as error:
        robot.port("front/pistn/x")
    assert str(error.value) == "kemba: no port 'front/pistn/x'; did you mean 'front/piston/x'?"


def test_the_rig_is_one_piston() -> None:
    rig = rig_mechanism(load_cylinder("dsnu-25-70"))
    assert (rig.n, list(rig.ports), rig.legs, rig.imposed) == (1, ["piston/x"], ("",), True)
    assert rig.stroke == 0.07
