"""Robot residuals: white where the model is right, sharp where an effect is missing."""

from typing import Any

import numpy as np
import pytest

pytest.importorskip("numba")

from robot_logs import hops
from twin import catalogue, measure

from kemba.identify.logs.reading import thinned
from kemba.identify.problem.problem import Problem
from kemba.identify.robot.filter import predicted_error
from kemba.identify.robot.problem import PREDICTED, RobotProblem, robot_problem
from kemba.model.spec import load_model
from kemba.trajectory import Trajectory


@pytest.fixture(scope="module")
def clean() -> RobotProblem:
    logs, _ = hops()
    return robot_problem(logs, load_model("planning"))


def problem_with(name: str, **fault: float) -> RobotProblem:
    if name.startswith("sensor"):
        logs, _ = hops(faults=(measure.sensor_fault(name, **fault),))
    else:
        logs, _ = hops(catalogue.hidden(name))
    return robot_problem(logs, load_model("planning"))


def explained(problem: RobotProblem, key: str) -> tuple[float, float]:
    """Best value of one parameter with the nuisance free, in sizes from off, and nats gained."""
    nuisance = list(problem.nuisance)
    candidate = problem.candidates[key.rsplit(".", 1)[0]]
    r = problem.residual({})
    jacobian = problem.jacobian({}, [key, *nuisance])
    jacobian *= [candidate.lead.size, *(problem.nuisance[n][1] for n in nuisance)]
    gram, slope = jacobian.T @ jacobian, jacobian.T @ r
    other = gram[1:, 1:] + np.eye(len(nuisance))
    solved = np.linalg.solve(other, np.column_stack([gram[1:, 0], slope[1:]]))
    information = gram[0, 0] - gram[0, 1:] @ solved[:, 0]
    pull = slope[0] - gram[0, 1:] @ solved[:, 1]
    return float(-pull / information), float(0.5 * pull**2 / information)


def test_it_is_a_problem_whose_rows_fit(clean: RobotProblem) -> None:
    assert isinstance(clean, Problem)
    rows, r = clean.rows(), clean.residual({})
    assert len(rows) == len(r) == len(clean.expected_power())
    assert np.isfinite(r).all()
    assert {"flight", "stance2", "impact"} <= set(rows.phase)
    assert {"00", "10", "01"} <= set(rows.mode)


def test_a_right_model_leaves_white_noise(clean: RobotProblem) -> None:
    rows, r = clean.rows(), clean.residual({})
    assert np.abs(r).max() < 6.0
    r = r / np.sqrt(clean.expected_power())
    for k, channel in enumerate(clean.physics.channels):
        own = (rows.channel == k) & (rows.phase == "flight")
        assert 0.8 < np.sqrt(np.mean(r[own] ** 2)) < 1.2, channel
        echo = np.corrcoef(r[own][1:], r[own][:-1])[0, 1]
        assert abs(echo) < 0.3, channel


@pytest.mark.parametrize("every", [2, 10])
def test_a_slow_channel_is_as_noisy_as_a_fast_one(every: int) -> None:
    """Rows without its readings have no part in the noise that is expected of it."""
    log = hops(runs=1)[0][0]
    columns = {}
    for name in log.names:
        left = log[name].copy()
        if name.startswith("body/"):
            left[np.arange(len(left)) % every != 0] = np.nan
        columns[f"{name} [{log.unit(name)}]"] = left
    slow = robot_problem([Trajectory(log.time, columns, log.meta)], load_model("planning"))
    rows, r = slow.rows(), slow.residual({}) / np.sqrt(slow.expected_power())
    for k in (0, 1, 2):
        assert 0.75 < np.sqrt(np.mean(r[rows.channel == k] ** 2)) < 1.35


def test_the_reference_follows_the_motion(clean: RobotProblem) -> None:
    y, seen = clean.state.motion.y, clean.batch.y
    error = np.sqrt(np.nanmean((y - seen) ** 2, axis=(0, 1)))
    assert np.all(error < 1.3 * clean.batch.sigma.max(axis=0))


@pytest.mark.parametrize(
    ("name", "key"),
    [
        ("seal_friction", "seal_friction.F_c"),
        ("valve_delay", "valve_delay.dt"),
        ("hip_friction", "hip_friction.T_c"),
        ("boom_force", "boom_force.F"),
        ("motor_lag", "motor_lag.T"),
        ("sensor_delay:rear/hip/q", "sensor_delay:rear/hip/q.dt"),
        ("sensor_bias:front/piston/x", "sensor_bias:front/piston/x.b"),
    ],
)
def test_a_hidden_effect_is_seen_in_its_size(name: str, key: str, clean: RobotProblem) -> None:
    size, gain = explained(problem_with(name), key)
    assert 0.6 < size < 1.4
    assert gain > 10.0
    size, gain = explained(clean, key)
    assert abs(size) < 0.35


def test_slopes_agree_with_differences(clean: RobotProblem) -> None:
    names = ["payload.m", "ground_friction.mu", "boom.mass", "tolerance.front/hip.mass"]
    slopes = clean.jacobian({}, names)
    base = clean.residual({})
    nominal = {"ground_friction.mu": 1.0, "boom.mass": 1.0}
    for name, slope in zip(names, slopes.T, strict=True):
        moved = clean.residual({name: nominal.get(name, 0.0) + 0.1})
        np.testing.assert_allclose((moved - base) / 0.1, slope, atol=1e-6 + 1e-6 * abs(slope).max())


def test_every_model_of_the_air_has_its_nominal_figures_free() -> None:
    (log, *_), _ = hops(runs=1)
    first, physical = (robot_problem([log], load_model(name)) for name in ("planning", "plant"))
    assert {f"chamber:{g}.F_extend" for g in ("front", "rear")} <= set(first.nuisance)
    assert "mode_damping:rear.c_none" in first.nuisance
    figures = ("gauge", "a_fill", "a_vent", "V_e", "V_r")
    for name in (f"orifice_chamber:{leg}.{f}" for leg in ("front", "rear") for f in figures):
        assert physical.nuisance[name] == (1.0, 0.02)
        assert np.linalg.norm(physical.jacobian({}, [name])) > 1.0
    assert physical.nuisance["seal_friction.F_c"] == (1.0, 0.1)  # as a discovery found it


def test_gaps_and_a_log_that_begins_in_the_air_are_borne() -> None:
    (log, *_), _ = hops(runs=1)
    late = log.time > 0.3
    columns = {h: log[n][late] for h, n in zip(log.headers, log.names, strict=True)}
    z = columns["body/z [m]"].copy()
    z[50:75] = np.nan
    cut = Trajectory(log.time[late], {**columns, "body/z [m]": z}, log.meta)
    r = robot_problem([cut], load_model("planning")).residual({})
    assert np.isfinite(r).all()
    assert np.sqrt(np.mean(r**2)) < 1.15


def test_denser_rows_are_thinned_and_sparse_ones_bridged() -> None:
    (log, *_), _ = hops(runs=1)
    valves = [n for n in log.names if "valve" in n or "tau" in n]
    for step in (0.25e-3, 2e-3):
        times = np.arange(log.time[0], log.time[-1], step)
        again = log.interpolate(times, hold=valves)
        problem = robot_problem([thinned(again)], load_model("planning"))
        assert 0.7e-3 <= np.median(problem.batch.h[problem.batch.valid]) <= 1.6e-3
        assert np.isfinite(problem.residual({})).all()


def test_states_that_are_not_asked_for_change_no_force(clean: RobotProblem) -> None:
    """No effect with a memory, and each by itself."""
    physics, state = clean.physics, clean.state
    delays = np.zeros((2 * len(physics.legs), 2))
    sizes = {c.key: c.lead.off + c.lead.size for c in clean.candidates.values()}
    switches = [physics.names[i] for i in physics._switches]
    assert len(switches) >= 2
    for on in ([], *([name] for name in switches)):
        p = physics.nominal.copy()
        for name in on:
            p[physics.names.index(name)] = sizes[name]
        few = physics.states_at(p)
        few_force, whole = (
            physics.call("residual", *state.motion.middle, *states, p=p)[0]
            for states in (state.states(p, delays, few), state.states(p, delays, None))
        )
        assert few_force == pytest.approx(whole, abs=1e-9 * np.abs(whole).max())
    assert len(physics.states_at(physics.nominal)) < len(physics.model.states)


def test_short_predictions_take_the_time_that_they_are_said_to(
    clean: RobotProblem, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of rows of 1 ms, as many as milliseconds; the model is right, and so is what it predicts."""
    asked = list[int]()

    def told(system: Any, y: Any, g: Any, steps: int) -> Any:
        asked.append(steps)
        return predicted_error(system, y, g, steps)

    monkeypatch.setattr("kemba.identify.robot.problem.predicted_error", told)
    errors = clean.window_errors({})
    row = float(np.median(clean.batch.h[clean.batch.valid]))
    assert asked == [round(PREDICTED / row)] and asked[0] > 2
    assert set(errors) == set(clean.physics.channels)
