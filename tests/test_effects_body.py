"""Body, hip and ground effects against independent mechanics."""

import math

import casadi as ca
import numpy as np
import pytest

from kemba.effects import Effect
from kemba.effects.mechanics.boom import Boom, BoomLever, BoomSpring
from kemba.effects.mechanics.ground import Contact, GroundCompliance
from kemba.effects.mechanics.hip import HipSpring, MotorLag, RotorInertia, TorqueScale
from kemba.effects.mechanics.load import ComOffset, MassSplit
from kemba.effects.sensors import as_measured
from kemba.effects.series import Series
from kemba.errors import KembaError
from kemba.mechanism import robot_mechanism
from kemba.model import Model, load_model

RNG = np.random.default_rng(3)


def dynamics(model: Model, **point: object) -> np.ndarray:
    """The first rows of the residual; whatever is not given is the nominal value or zero."""
    node, n = model.node, model.mechanism.n
    stand = [model.mechanism.standing[c.name] for c in model.mechanism.coordinates]
    zero = {name: np.zeros(getattr(node, name).numel()) for name in node.NAMES}
    rest = np.array([q.value for q in model.states.values()])
    full = {**zero, "q": np.array(stand), "s": rest, **point}
    assert np.size(full["v"]) == n
    return np.asarray(node.residual(**full)["dynamics"]).ravel()


def added(*effects: Effect, **point: object) -> np.ndarray:
    """What effects on no state of their own add to the left-hand side."""
    return dynamics(load_model(extra=effects), **point) - dynamics(load_model(), **point)


def test_com_offset_is_the_mass_moved() -> None:
    """Lagrange's equations of M at (d, 0) in the body, less those of M at its centre."""
    d, M, g = 0.02, 2.886, 9.81
    q, v, a = (ca.SX.sym(name, 3) for name in "qva")
    at = ca.vertcat(q[0] + d * ca.cos(q[2]), q[1] + d * ca.sin(q[2]))

    def lagrange(position: ca.SX) -> ca.SX:
        rate = ca.jtimes(position, q, v)
        L = M / 2 * ca.dot(rate, rate) - M * g * position[1]
        impulse = ca.gradient(L, v)
        return ca.jtimes(impulse, q, v) + ca.jtimes(impulse, v, a) - ca.gradient(L, q)

    wanted = ca.Function("wanted", [q, v, a], [lagrange(at) - lagrange(q[:2])])
    for _ in range(3):
        point = {name: RNG.standard_normal(7) for name in "qva"}
        expected = np.asarray(wanted(*(point[name][:3] for name in "qva"))).ravel()
        np.testing.assert_allclose(added(ComOffset(d=d), **point)[:3], expected, rtol=1e-9)


def test_springs_rest_in_the_standing_pose() -> None:
    assert np.abs(added(HipSpring(k=1.5), BoomSpring(k=15))).max() < 1e-12
    off = added(HipSpring(k=1.5, q0=0.1, on="front"), BoomSpring(k=15, z0=0.2))
    stand = load_model().mechanism.standing
    assert off[3] == pytest.approx(1.5 * (stand["front/hip/q"] - 0.1))
    assert off[1] == pytest.approx(15 * (stand["body/z"] - 0.2))


def test_hip_chain_is_scaled_then_lagged() -> None:
    model = load_model(extra=[TorqueScale(k=0.9), MotorLag(T=0.005)])
    node = model.node
    inputs = [q.name for q in model.inputs.values()]
    states = [q.name for q in model.states.values()]
    u, s = np.zeros(len(inputs)), np.zeros(len(states))
    u[inputs.index("front/hip/tau")], s[states.index("front/hip/tau_a")] = 10.0, 4.0
    zero = {name: np.zeros(getattr(node, name).numel()) for name in node.NAMES}
    rate = np.asarray(node.residual(**{**zero, "u": u, "s": s})["rate"]).ravel()
    assert -rate[states.index("front/hip/tau_a")] == pytest.approx((0.9 * 10 - 4) / 0.005)
    pushed = dynamics(model, u=u, s=s) - dynamics(model, u=u)
    assert pushed[3] == pytest.approx(-4.0)


def test_rotor_inertia_adds_to_the_joint() -> None:
    a = RNG.standard_normal(7)
    np.testing.assert_allclose(added(RotorInertia(J=0.01), a=a)[3:5], 0.01 * a[3:5])


@pytest.mark.parametrize("depth, sinking", [(0.004, 0.0), (0.004, 0.5), (0.004, -0.6)])
def test_compliant_floor_gives_its_force_at_its_depth(depth: float, sinking: float) -> None:
    """The gap pair closes exactly where lam_n = k pen (1 + d pen')."""
    floor = GroundCompliance(k=2e4)
    force = 2e4 * depth * (1 + sinking)
    assert floor.penetration(force, sinking) == pytest.approx(depth, rel=1e-3)


def test_compliant_floor_never_pulls() -> None:
    floor = GroundCompliance(k=2e4)
    assert floor.penetration(10.0, -3.0) > 1.0, "leaving fast, no depth gives a force"
    assert floor.penetration(0.0, -3.0) == 0.0


def test_hard_compliant_floor_is_the_rigid_contact() -> None:
    hard = load_model(extra=[GroundCompliance().bind({"k": math.inf})])
    labels = {row.label.split(":")[0] for row, _ in hard.node.pair_rows}
    assert not any(label.endswith("/contact") for label in labels)
    assert set(hard.forces.values()) == set(load_model().forces.values())
    assert floor_keys() == Contact().forces().keys()


def floor_keys() -> object:
    return GroundCompliance().forces().keys()


def test_mass_split_is_a_robot_file_with_other_masses() -> None:
    """Nothing is lost, and the equations are those of the links as they are then."""
    m = 0.2
    model, plain = load_model(extra=[MassSplit(m=m)]), load_model()
    robot, drawn = model.mechanism.need_robot(), plain.mechanism.need_robot()
    assert model.mechanism.mass == pytest.approx(plain.mechanism.mass)
    assert robot.body.mass == pytest.approx(drawn.body.mass - m)
    assert robot.leg.tibia.mass / drawn.leg.tibia.mass == pytest.approx(1 + m / (2 * 0.795))
    assert robot.leg.tibia.com == drawn.leg.tibia.com
    point = {name: RNG.standard_normal(7) for name in "qva"}
    free = plain.with_effects([MassSplit()]).build(["mass_split.m"])
    zero = {name: np.zeros(getattr(free, name).numel()) for name in free.NAMES}
    found = free.residual(**{**zero, **point, "p": [m]})["dynamics"]
    same = dynamics(Model(robot_mechanism(robot), plain.effects), s=zero["s"], **point)
    np.testing.assert_allclose(np.asarray(found).ravel(), same, atol=1e-9)
    # the same mass on the body, taken off again as links: nothing at all while nothing turns
    falling = {"a": np.array([0.7, -9.81, 0, 0, 0, 0, 0]), "q": point["q"]}
    np.testing.assert_allclose(added(MassSplit(m=m), **falling)[:2], 0.0, atol=1e-9)


def test_mass_is_not_split_beyond_what_there_is() -> None:
    with pytest.raises(KembaError, match=r"mass_split.*m = 3 kg.*no mass"):
        load_model(extra=[MassSplit(m=3.0)])


def test_a_longer_boom_is_lighter_and_its_encoders_show_less() -> None:
    k = 0.02
    point = {name: RNG.standard_normal(7) for name in "qva"}
    longer = Boom(length_x=(1 + k) * 2.575, length_z=(1 + k) * 2.493)
    wanted = added(longer, **point)
    np.testing.assert_allclose(added(BoomLever(k=k), **point), wanted, atol=1e-12)
    assert np.abs(wanted[:2]).min() > 1e-3
    time = np.linspace(0.0, 0.1, 11)
    for channel, share in (("body/x", 1 / (1 + k)), ("body/z", 1 / (1 + k)), ("body/pitch", 1.0)):
        shown = as_measured([BoomLever(k=k)], channel, Series(time, time + 0.3)).value
        np.testing.assert_allclose(shown, share * (time + 0.3))
