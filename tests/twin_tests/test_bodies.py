"""The blind twin is only worth something if its own physics is right: bodies and ground."""

import numpy as np
import pytest

pytest.importorskip("numba")

from twin import (
    figures,
    layout,
    machine,
    run,
)
from twin.bodies import NC, NQ, constraints, masses
from twin.catalogue import hidden
from twin.control import R_FOLLOW, R_KD, R_KP
from twin.scripts import Script, clock, in_air, script, short_hop

WEIGHT = figures.Robot().total_mass * figures.GRAVITY + figures.Robot().boom_weight


def loose_flight(duration=0.3) -> Script:
    """Everything limp and moving, in the air, valves shut."""
    rates = (0.5, 1.0, 1.0, 3.0, -2.0, 0.1, -0.1)
    motion = script("loose", clock(duration), [], in_air(1.0, (0.03, 0.04), 0.1, rates), follow=0.0)
    motion.refs[:, [R_FOLLOW, R_KP, R_KD]] = 0.0
    return motion


def test_constraints_do_not_drift(hop):
    index, value = np.empty((NC, 6), dtype=np.int64), np.empty((NC, 6))
    gap, bias = np.empty(NC), np.empty(NC)
    worst = 0.0
    for q, v in zip(hop.q[::7], hop.v[::7], strict=True):
        constraints(q, v, index, value, gap, bias)
        worst = max(worst, np.abs(gap).max())
    assert worst < 1e-7


def test_energy_stays_in_free_flight():
    robot = figures.Robot()
    robot.air[:, figures.N_C00 : figures.N_C11 + 1] = 0.0
    truth = run.simulate(loose_flight(0.12), robot=robot, ground=False)
    assert 1e-3 < truth.y[:, 5:7].min() < truth.y[:, 5:7].max() < 0.069  # no end stop
    m = masses(robot)
    hips = truth.w[:, 3:5]
    energy = 0.5 * (truth.v**2 @ m) + 0.5 * robot.rotor * (hips**2).sum(axis=1)
    energy += figures.GRAVITY * truth.q[:, 1::3] @ robot.mass + robot.boom_weight * truth.q[:, 1]
    assert np.ptp(energy) < 1e-6 * energy[0]


def test_momentum_changes_by_weight_alone():
    motion = loose_flight()
    motion.refs[:, R_KP], motion.refs[:, R_KD] = 100.0, 2.0
    motion.sent[20:80, 0] = motion.sent[40:90, 3] = 1.0
    truth = run.simulate(motion, ground=False)
    m = masses(figures.Robot())
    sideways, upwards = truth.v[:, 0::3] @ m[0::3], truth.v[:, 1::3] @ m[1::3]
    assert np.ptp(sideways) < 1e-8
    assert np.allclose(upwards, upwards[0] - WEIGHT * truth.times, atol=1e-7)


def test_falls_with_the_boom():
    motion = script("fall", clock(0.2), [], in_air(1.0, (0.0, 0.0)), follow=0.0)
    motion.refs[:, 0:2] = motion.start.hips
    truth = run.simulate(motion)
    fall = 2.0 * (truth.y[0, 1] - truth.y[-1, 1]) / truth.times[-1] ** 2
    assert fall == pytest.approx(10.7, abs=0.1)


@pytest.mark.parametrize("kind,extra", [(None, 0.0), ("payload", 0.3 * 9.81), ("boom_force", -4.0)])
def test_standing_feet_carry_the_weight(kind, extra):
    truth = run.simulate(script("stand", clock(0.15), []), [hidden(kind)] if kind else [])
    assert truth.foot[-1, :, 1].sum() == pytest.approx(WEIGHT + extra, rel=2e-4)
    assert np.ptp(truth.y[:, 1]) < 1e-5
    assert -layout.feet(truth.q)[..., 1].min() < 2e-5


def test_offset_centre_of_mass_loads_the_front():
    truth = run.simulate(script("stand", clock(0.15), []), [hidden("com_offset", 1.0)])
    front, rear = truth.foot[-1, :, 1]
    feet = layout.feet(truth.q)[-1, :, 0]
    moment = 2.886 * 9.81 * 0.02
    assert front - rear == pytest.approx(2.0 * moment / (feet[0] - feet[1]), rel=0.03)


def test_apex_converges_with_the_step():
    apex = [run.simulate(short_hop(), step=h).y[:, 1].max() for h in (40e-6, 20e-6, 10e-6)]
    assert abs(apex[0] - apex[1]) < 1e-5
    assert abs(apex[1] - apex[2]) < 1e-5


def test_ground_is_as_good_as_rigid(hop):
    assert -layout.feet(hop.q)[..., 1].min() < 4e-4
    dropped = run.simulate(script("drop", clock(0.3), [], in_air(0.22, (0.0, 0.0))))
    height = layout.feet(dropped.q)[..., 1].min(axis=1)
    touched = int(np.argmax(height < 0.0))
    assert touched > 0
    assert height[touched:].max() < 1e-3  # hardly any rebound
    ends = np.maximum(-dropped.y[:, 5:7], dropped.y[:, 5:7] - figures.STROKE)
    assert ends.max() < 2e-4


def test_orifice_robot_also_jumps(hop):
    truth = run.simulate(short_hop(), chambers="orifice")
    assert truth.finite
    assert truth.y[:, 1].max() == pytest.approx(hop.y[:, 1].max(), abs=0.15)


def test_motor_never_exceeds_its_limits(hop):
    assert np.abs(hop.command).max() <= figures.PEAK_TORQUE


def test_state_size():
    assert machine.NY == 2 * NQ + 2 * 6 + 1
