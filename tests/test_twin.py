"""The blind twin is only worth something if its own physics is right."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("numba")

from twin import (
    air,
    bench,
    cases,
    catalogue,
    figures,
    layout,
    library,
    loads,
    logs,
    machine,
    measure,
    motions,
    rigs,
    run,
    scripts,
    valves,
)
from twin.bodies import NC, NQ, constraints
from twin.catalogue import CATALOGUE, hidden
from twin.control import R_FOLLOW, R_KD, R_KP
from twin.scripts import FRONT_E, FRONT_R, REAR_E, REAR_R, Script, clock, in_air, script

WEIGHT = figures.Robot().total_mass * figures.GRAVITY + figures.Robot().boom_weight


def short_hop(duration=0.4) -> Script:
    pulses = [(FRONT_E, 0.0, 0.14), (REAR_E, 0.004, 0.147)]
    pulses += [(FRONT_R, 0.2, 0.3), (REAR_R, 0.2, 0.25), (FRONT_E, 0.25, 0.3)]
    knots = [(0.0, 0.0, 0.0), (0.15, -0.05, -0.08), (0.4, 0.1, 0.0)]
    return script("hop", clock(duration), pulses, offsets=knots)


@pytest.fixture(scope="module")
def hop():
    return run.simulate(short_hop())


def loose_flight(duration=0.3) -> Script:
    """Everything limp and moving, in the air, valves shut."""
    rates = (0.5, 1.0, 1.0, 3.0, -2.0, 0.1, -0.1)
    motion = script("loose", clock(duration), [], in_air(1.0, (0.03, 0.04), 0.1, rates), follow=0.0)
    motion.refs[:, [R_FOLLOW, R_KP, R_KD]] = 0.0
    return motion


def masses(robot):
    m = np.zeros(NQ)
    m[0::3], m[1::3], m[2::3] = robot.mass, robot.mass, robot.inertia
    m[0] += robot.boom_mx
    m[1] += robot.boom_mz
    return m


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


def test_same_seed_same_log(tmp_path):
    texts = []
    for name in "ab":
        paths, _ = cases.robot_case(
            tmp_path / name, "boom_force", seed=4, runs=1, scripts=[short_hop(0.1)]
        )
        texts.append(paths[0].read_bytes())
    assert texts[0] == texts[1]
    other, _ = cases.robot_case(tmp_path / "c", "boom_force", seed=5, runs=1,
                                scripts=[short_hop(0.1)])  # fmt: skip
    assert other[0].read_bytes() != texts[0]


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


def air_rates(effects, state, u=(1.0, 0.0), x=0.02):
    leg, _, _ = catalogue.tables(effects)
    out = np.zeros(6)
    demand = air.air_rates(
        x, 0.0, *u, np.array(state), 0.9, figures.Robot().air[0], leg[0], False, out
    )
    return out, demand


def test_air_effects_are_their_equations():
    state = [200.0, 50.0, 0.3, 0.1, 0.0, 0.0]
    plain, demand = air_rates([], state)
    tau = 0.008 + 2.0 / 7.0 * 0.017
    assert plain[0] == pytest.approx((0.9 * 324.0 - 200.0) / tau)
    assert demand == pytest.approx((0.9 - 200.0 / 324.0) / tau)
    leaking, _ = air_rates([hidden("cross_leak")], state)
    gap = 3.0 * (200.0 / figures.AREA_E - 50.0 / figures.AREA_R)
    change = leaking[:2] - plain[:2]
    assert np.allclose(change, [-gap * figures.AREA_E, gap * figures.AREA_R])
    slower, _ = air_rates([hidden("rise_time_scale")], state)
    assert np.allclose(slower[:2], plain[:2] / 1.25)
    more, _ = air_rates([hidden("supply_scale")], state)
    assert more[0] - plain[0] == pytest.approx(0.1 * 0.9 * 324.0 / tau)
    lagged, _ = air_rates([hidden("hose_lag")], state)
    assert lagged[2] == pytest.approx((1.0 - 0.3) / 0.004)
    filtered, _ = air_rates([], state, u=(0.3, 0.1))
    assert np.allclose(lagged[:2], filtered[:2])


def test_locked_step_follows_table_one():
    ticks = clock(0.2)
    sent = np.zeros((ticks.size, 2))
    sent[10:, 0] = 1.0
    still = np.zeros(ticks.size)
    truth = bench.simulate(rigs.Rig("step", ticks, still, still, sent))
    after = truth.times - 0.016
    expected = np.where(after > 0, 324.0 * (1.0 - np.exp(-np.maximum(after, 0.0) / 0.008)), 0.0)
    assert np.allclose(truth.force, expected, atol=1e-3)


def test_orifice_chamber_is_like_the_table_but_not_it():
    ticks = clock(0.3)
    sent = np.zeros((ticks.size, 2))
    sent[:150, 0] = 1.0
    for x, rise, vent in ((0.0, 0.008, 0.013), (0.07, 0.025, 0.037)):
        still = np.full(ticks.size, x)
        rig = rigs.Rig("step", ticks, still, np.zeros(ticks.size), sent)
        truth = bench.simulate(rig, chambers="orifice")
        full = truth.force.max()
        assert full == pytest.approx(324.0, rel=0.01)
        up = truth.times[np.argmax(truth.force > 0.632 * full)] - 0.006
        down = truth.times[truth.times > 0.15][
            np.argmax(truth.force[truth.times > 0.15] < 0.368 * full)
        ] - 0.156  # fmt: skip
        assert up == pytest.approx(rise, rel=0.25)
        assert down == pytest.approx(vent, rel=0.25)
    assert air.thin_plate(2e5, 2e5) == 0.0


def test_orifice_robot_also_jumps(hop):
    truth = run.simulate(short_hop(), chambers="orifice")
    assert truth.finite
    assert truth.y[:, 1].max() == pytest.approx(hop.y[:, 1].max(), abs=0.15)


def test_late_valves_merge_pulses():
    pulses = [(0.0, 0.010), (0.013, 0.020), (0.05, np.inf)]
    assert valves.shifted(pulses, 0.006, 0.010) == [(0.006, 0.030), (0.056, np.inf)]
    early = valves.shifted([(0.0, 0.004)], 0.006, 0.001)
    assert early == []  # closing so early swallows the pulse


def test_motor_never_exceeds_its_limits(hop):
    assert np.abs(hop.command).max() <= figures.PEAK_TORQUE


def test_sensor_faults_touch_only_their_channel(hop):
    quiet = cases.quiet()
    plain = measure.robot_log(hop, quiet)
    for name, change in {
        "sensor_bias:body/pitch": lambda c: c + 1.5e-3,
        "sensor_scale:rear/piston/x": lambda c: 1.02 * c,
    }.items():
        faulty = measure.robot_log(hop, quiet, [measure.sensor_fault(name)])
        column = measure.header(name.split(":")[1])
        assert np.allclose(faulty.pop(column), change(plain[column]))
        assert all(np.array_equal(faulty[k], plain[k]) for k in faulty)
    late = measure.robot_log(hop, quiet, [measure.sensor_fault("sensor_delay:body/z")])
    assert np.allclose(late["body/z [m]"][3:], plain["body/z [m]"][:-3], atol=1e-6)


def test_accelerometer_is_the_mean_over_its_sample(hop):
    log = measure.robot_log(hop, cases.quiet(measure.Sensors(accelerometer=True)))
    gained = np.cumsum(log["body/az [m.s-2]"][1:]) * 1e-3
    assert np.allclose(gained, hop.w[2::2, 1] - hop.w[0, 1], atol=1e-9)


def test_logs_have_the_format(tmp_path):
    sensors = measure.Sensors(velocities=True, accelerometer=True, force=True, pressures=True,
                              feet=True, gaps=0.02)  # fmt: skip
    paths, truth = cases.robot_case(
        tmp_path, ["seal_friction", "sensor_scale:front/hip/q"], seed=1, runs=1, sensors=sensors,
        scripts=[short_hop(0.2)], floor=0.1,
    )  # fmt: skip
    log = logs.read(paths[0])
    needed = ["time [s]", "body/x [m]", "body/z [m]", "body/pitch [rad]"]
    for side in ("front", "rear"):
        needed += [f"{side}/hip/q [rad]", f"{side}/hip/tau [N.m]", f"{side}/piston/x [m]",
                   f"{side}/valve/extend [1]", f"{side}/valve/retract [1]"]  # fmt: skip
    assert set(needed) <= set(log)
    assert next(iter(log)) == "time [s]"
    assert (np.diff(log["time [s]"]) > 0).all()
    assert np.isnan(log["body/z [m]"]).any()
    assert set(np.unique(log["rear/valve/extend [1]"])) <= {0.0, 1.0}
    sidecar = paths[0].with_suffix(".meta.yaml").read_text()
    assert sidecar.startswith("kind: robot\nrun: 0\n")
    kinds = [e["kind"] for e in truth["effects"]]
    assert kinds == ["seal_friction", "sensor_scale:front/hip/q"]
    assert json.loads((tmp_path / ".truth" / "truth.json").read_text())["effects"]


def test_bench_case_from_the_terminal(tmp_path):
    command = [sys.executable, "-m", "twin", "bench", "--effect", "hose_lag", "--seed", "3",
               "--runs", "2", "--out", str(tmp_path), "--with", "pressures"]  # fmt: skip
    done = subprocess.run(
        command, cwd=Path(__file__).parent, capture_output=True, text=True, check=True
    )
    paths = [Path(p) for p in done.stdout.split()]
    log = logs.read(paths[0])
    assert list(log)[:3] == ["time [s]", "piston/x [m]", "piston/F [N]"]
    assert {"valve/extend [1]", "valve/retract [1]", "supply/P [Pa]"} <= set(log)


def test_controller_table_is_executed(tmp_path):
    table = tmp_path / "controller.csv"
    header = ("time [s],front/hip/q [rad],front/hip/w [rad.s-1],front/hip/tau [N.m],"
              "rear/hip/q [rad],rear/hip/w [rad.s-1],rear/hip/tau [N.m],front/valve/extend [1],"
              "front/valve/retract [1],rear/valve/extend [1],rear/valve/retract [1]")  # fmt: skip
    q = figures.STANCE_HIP
    rows = [f"{k / 1000:.3f},{-q},0,0,{q},0,0,{int(k < 60)},0,{int(k < 60)},0" for k in range(100)]
    table.write_text("\n".join([header, *rows]) + "\n")
    truth = run.simulate(scripts.from_table(table))
    assert truth.finite
    assert truth.y[:, 1].max() > truth.y[0, 1] + 1e-3


def test_a_fall_ends_the_log_early(hop):
    falling = replace(hop, y=hop.y.copy())
    falling.y[400:, 2] = 1.0
    kept = motions.upright(falling)
    assert kept.ticks.size == 400 // hop.split - 20 + 1
    assert kept.finite
    assert motions.sane(kept)
    assert motions.upright(hop) is hop


@pytest.mark.slow
def test_every_motion_can_be_drawn():
    for name in motions.MOTIONS:
        assert motions.sane(run.simulate(library.motion(name, 1)))


def test_state_size():
    assert machine.NY == 2 * NQ + 2 * 6 + 1
