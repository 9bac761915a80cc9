"""Passive flight, integrated by another hand: energy and momentum with the boom's share."""

from functools import lru_cache

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest
from oracle.robots import case
from scipy.integrate import solve_ivp

from kemba.effects.mechanics.boom import Boom
from kemba.model import Model

TIMES = np.linspace(0.0, 0.12, 25)
BOOM = Boom()


@lru_cache(maxsize=1)
def flight() -> tuple[np.ndarray, np.ndarray]:
    """q and v (times, n) of the robot thrown spinning, its joints slack."""
    robot = case("kemba")
    model = Model(robot.mechanism, [BOOM])
    node, n = model.node, model.mechanism.n
    M = ca.jacobian(node.dynamics, node.a)
    bias = ca.substitute(node.dynamics, node.a, ca.SX.zeros(n))
    forward = ca.Function("forward", [node.q, node.v], [-ca.solve(M, bias)])

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[n:], np.array(forward(y[:n], y[n:])).ravel()])

    q = np.array([model.mechanism.standing[c.name] for c in model.mechanism.coordinates])
    q += np.array([0.1, 0.5, 0.2, 0.1, -0.3, -0.6, 0.8])
    v = np.array([0.7, 2.0, 1.5, -2.0, 1.0, -3.0, 2.0])
    found = solve_ivp(rate, (0.0, TIMES[-1]), [*q, *v], "DOP853", TIMES, rtol=1e-11, atol=1e-12)
    assert found.success
    return found.y[:n].T, found.y[n:].T


def test_energy_is_kept() -> None:
    robot = case("kemba")
    weight = BOOM.mass * robot.robot.gravity * BOOM.com / BOOM.length_z
    energies = []
    for q, v in zip(*flight(), strict=True):
        q_tree, _, v_tree, _ = robot.open(q, v, np.zeros_like(q))
        data = robot.tree.createData()
        bodies = pin.computeKineticEnergy(robot.tree, data, q_tree, v_tree)
        bodies += pin.computePotentialEnergy(robot.tree, data, q_tree)
        rotors = 0.5 * robot.robot.leg.rotor_inertia * (v[3] ** 2 + v[4] ** 2)
        boom = 0.5 * BOOM.inertia * ((v[0] / BOOM.length_x) ** 2 + (v[1] / BOOM.length_z) ** 2)
        energies.append(bodies + rotors + boom + weight * q[1])
    assert np.ptp(energies) < 1e-8 * abs(energies[0])


def test_momentum_changes_by_weight_alone() -> None:
    robot = case("kemba")
    momenta = []
    for q, v in zip(*flight(), strict=True):
        q_tree, _, v_tree, _ = robot.open(q, v, np.zeros_like(q))
        data = robot.tree.createData()
        pin.centerOfMass(robot.tree, data, q_tree, v_tree)
        legged = data.mass[0] * data.vcom[0][[0, 2]]
        levers = np.array([BOOM.length_x, BOOM.length_z])
        momenta.append(legged + BOOM.inertia / levers**2 * v[:2])
    weight = robot.mechanism.weight
    weight += BOOM.mass * robot.robot.gravity * BOOM.com / BOOM.length_z
    gained = np.array(momenta) - momenta[0]
    assert gained[:, 0] == pytest.approx(0.0, abs=1e-9)
    assert gained[:, 1] == pytest.approx(-weight * TIMES, abs=1e-8)
