"""Every effect of the blind twin shows, and is the formula it says."""

import numpy as np
import pytest

pytest.importorskip("numba")

from twin import (
    bench,
    catalogue,
    figures,
    layout,
    loads,
    machine,
    rigs,
    run,
)
from twin.bodies import NQ, masses
from twin.catalogue import CATALOGUE, hidden
from twin.scripts import clock, short_hop

BENCH_EFFECTS = [n for n, e in CATALOGUE.items() if e.bench]
ROBOT_EFFECTS = [n for n, e in CATALOGUE.items() if not e.bench]


def bench_rig():
    rig = rigs.random_motion(clock(1.5), np.random.default_rng(1), fastest=1.2)
    rig.sent[300:700] = 1.0
    return rig


@pytest.mark.parametrize("name", BENCH_EFFECTS)
def test_effect_shows_on_the_bench(name):
    plain, changed = bench.simulate(bench_rig()), bench.simulate(bench_rig(), [hidden(name)])
    assert np.abs(changed.force - plain.force).max() > 1.0
    assert np.isfinite(changed.force).all()


@pytest.mark.parametrize("name", ROBOT_EFFECTS)
def test_effect_shows_on_the_robot(name, hop):
    changed = run.simulate(short_hop(), [hidden(name)])
    difference = np.abs(changed.y - hop.y).max(axis=0)
    assert changed.finite
    assert difference.max() > 2e-4


@pytest.mark.parametrize("kind", [n for n in BENCH_EFFECTS if CATALOGUE[n].room == "leg"])
def test_one_leg_only(kind):
    leg, _, _ = catalogue.tables([hidden(kind, on="front")])
    neutral, _, _ = catalogue.tables([])
    assert (leg[1] == neutral[1]).all()
    assert (leg[0] != neutral[0]).any()


POSE = (0.1, 0.5, 0.05, (-0.9, 0.8), (0.03, 0.045))
SPEED = np.array([0.3, -0.5, 0.4, 0.05, -2.0, 0.02, -0.3])  # x, z, pitch, hips, pistons
TORQUE = np.array([3.0, -5.0])


def generalised(effects):
    """M a on the seven coordinates, without the effect's own inertia; and the accelerations."""
    robot = figures.Robot()
    leg, body, _ = catalogue.tables(effects)
    y = np.zeros(machine.NY)
    y[:NQ], y[NQ : 2 * NQ] = layout.push(*POSE, SPEED)
    y[loads.SUPPLY] = 1.0
    y[loads.AIR : loads.SUPPLY] = [200.0, 50.0, 0, 0, 0, 0, 100.0, 150.0, 0, 0, 0, 0]
    dy, out = np.zeros(machine.NY), np.zeros(machine.NOUT)
    machine.rates(
        y, np.array([1.0, 0.0, 1.0, 1.0]), TORQUE, np.zeros(7), np.zeros(2), robot.mass,
        robot.inertia, run.scalars(robot, False, False), robot.air, leg, body,
        machine.workspace(), dy, out,
    )  # fmt: skip
    a = dy[NQ : 2 * NQ]
    force = masses(robot) * a
    for f in (5, 17):  # the nominal hip rotors
        twist = robot.rotor * (a[f] - a[2])
        force[f] += twist
        force[2] -= twist
    directions = np.stack([layout.push(*POSE, unit)[1] for unit in np.eye(7)])
    return directions @ force, a


def coulomb(v):
    return np.tanh(v / 0.01)


X, V = np.array([0.03, 0.045]), SPEED[5:7]
HIPS, SPIN = np.array(POSE[3]), SPEED[3:5]
REST = np.array([-figures.STANCE_HIP, figures.STANCE_HIP])
EXPECTED = {
    "seal_friction": {5: -10.0 * coulomb(V)},
    "pressure_friction": {5: -0.04 * 250.0 * coulomb(V)},
    "piston_damping": {5: -15.0 * V},
    "gas_spring": {5: -400.0 * (X - 0.035)},
    "both_mode_loss": {5: [0.0, -15.0]},
    "hip_friction": {3: -0.6 * np.tanh(SPIN / 0.1)},
    "hip_damping": {3: -0.1 * SPIN},
    "hip_spring": {3: -1.5 * (HIPS - REST)},
    "torque_scale": {3: 0.1 * TORQUE},
    "boom_force": {1: 4.0},
    "boom_friction": {0: -2.0 * np.tanh(SPEED[0:2] / 0.02)},
    "boom_damping": {0: -2.0 * SPEED[0:2]},
    "boom_spring": {1: -15.0 * (0.5 - figures.STANCE_Z)},
    "pitch_friction": {2: -0.3 * np.tanh(0.4 / 0.05)},
    "payload": lambda a: {0: -0.3 * np.array([a[0], a[1] + figures.GRAVITY])},
    "boom_inertia": lambda a: {0: -0.2 * a[0:2]},
    "rotor_inertia": lambda a: {3: -0.01 * np.array([a[5] - a[2], a[17] - a[2]])},
}


@pytest.mark.parametrize("name", EXPECTED)
def test_effort_is_the_formula_at_its_port(name):
    """Equation and sign of an effect, read off the bodies' accelerations."""
    plain, _ = generalised([])
    changed, a = generalised([hidden(name)])
    expected = np.zeros(7)
    rows = EXPECTED[name](a) if callable(EXPECTED[name]) else EXPECTED[name]
    for first, value in rows.items():
        expected[first : first + np.size(value)] = value
    assert np.allclose(changed - plain, expected, atol=1e-5)


def test_friction_is_the_formula():
    rig = rigs.slow_stroke(clock(2.0), np.random.default_rng(0), 0.05)
    plain = bench.simulate(rig)
    for name, formula in {
        "seal_friction": lambda v, x: -10.0 * np.tanh(v / 0.01),
        "stribeck_friction": lambda v, x: -10.0 * np.exp(-((v / 0.05) ** 2)) * np.tanh(v / 0.01),
        "quadratic_damping": lambda v, x: -40.0 * v * np.abs(v),
        "gas_spring": lambda v, x: -400.0 * (x - 0.035),
    }.items():
        changed = bench.simulate(rig, [hidden(name)])
        assert np.allclose(changed.force - plain.force, formula(plain.v, plain.x), atol=1e-9), name
