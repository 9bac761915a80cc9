"""In the air: energy, momentum, order of convergence."""

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plant.scripts import AIRBORNE, affine, planning

from kemba.effects.mechanics.boom import Boom
from kemba.mechanism import load_robot, robot_mechanism
from kemba.mechanism.robot import build_pin_model, tree_angles
from kemba.model import Model
from kemba.plant.commands import Commands, Profile
from kemba.plant.simulate import run, simulate
from kemba.trajectory import Trajectory


def states(model: Model, t: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    q = np.column_stack([t[c.name] for c in model.mechanism.coordinates])
    return q, np.column_stack([t[c.name] for c in model.mechanism.velocities])


def inertia(model: Model, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    return affine(model, q, v, 0.0, 0.0)[0]


def energies(model: Model, t: Trajectory, lift: float = 0.0) -> np.ndarray:
    """Kinetic and potential energy [J] at every row; `lift` [N] is a constant downward force."""
    robot = load_robot("kemba")
    tree = build_pin_model(robot)
    data = tree.createData()
    symbol = model.mechanism.q
    angles = ca.Function("tree", [symbol], [tree_angles(robot, symbol)])
    total = []
    for q, v in zip(*states(model, t), strict=True):
        kinetic = 0.5 * v @ inertia(model, q, v) @ v
        height = pin.computePotentialEnergy(tree, data, np.asarray(angles(q)).ravel())
        total.append(kinetic + height + lift * q[1])
    return np.array(total)


@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_free_flight_conserves_energy_and_momentum(seed: int) -> None:
    bare, rng = Model(robot_mechanism(load_robot("kemba")), []), np.random.default_rng(seed)
    rates = {
        c.name: rng.normal(0.0, 1.0) for c in bare.mechanism.velocities if "knee" not in c.name
    }
    t = simulate(bare, {**AIRBORNE, **rates}, duration=0.2, step=1e-4, sample=0.01)
    total = energies(bare, t)
    assert np.ptp(total) < 1e-6 * total[0]
    forward = [inertia(bare, q, v)[0] @ v for q, v in zip(*states(bare, t), strict=True)]
    assert np.ptp(forward) < 1e-8


def test_the_boom_carries_energy_too() -> None:
    boom = Boom()
    model = Model(robot_mechanism(load_robot("kemba")), [boom])
    t = simulate(model, AIRBORNE, duration=0.3, sample=0.01)
    weight = boom.mass * 9.81 * boom.com / boom.length_z
    assert np.ptp(energies(model, t, weight)) < 1e-6 * 40.0


@pytest.mark.parametrize("driven", [False, True], ids=["in the air", "pushing off"])
def test_second_order_between_events(driven: bool) -> None:
    def end(step: float) -> np.ndarray:
        on = Profile.constant(float(driven))
        valves = {f"{leg}/valve/extend": on for leg in ("front", "rear")}
        start = {f"{leg}/chamber/extend/F": 200.0 for leg in ("front", "rear")}
        t = run(
            planning(), start if driven else AIRBORNE, Commands(valves), 0.03, step, 0.03, False
        ).trajectory
        return np.array([t[c.name][-1] for c in planning().mechanism.velocities])

    exact = end(1e-5)
    coarse, fine = (np.abs(end(step) - exact).max() for step in (4e-4, 2e-4))
    assert np.log2(coarse / fine) > 1.8
    assert fine < 1e-4
