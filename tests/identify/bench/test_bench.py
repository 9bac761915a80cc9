"""The bench problem: prediction, event times, chambers, and the loop from logs to a model."""

import json
from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

from kemba.effects import BY_KIND
from kemba.effects.base import Effect
from kemba.effects.pneumatics.switching import delayed, is_on, pulses
from kemba.identify.adopt import adopt_effect
from kemba.identify.bench.bench_log import SmoothedMotion
from kemba.identify.bench.prediction import RigModel, absolute_pressure
from kemba.identify.bench.problem import bench_problem
from kemba.identify.design.rig import propose
from kemba.identify.design.separation import DesignSearchSettings, ExperimentSettings
from kemba.identify.infer.linear import Linear, estimate, names_of, priors
from kemba.identify.workflow import discover_logs
from kemba.model.spec import load_model, load_spec
from kemba.plant.commands import Profile
from kemba.plant.rigs import drive, hermite
from kemba.trajectory import Trajectory

BenchLog = Callable[..., Trajectory]


def effect(kind: str, **values: float) -> Effect:
    return BY_KIND[kind](**values)  # type: ignore[arg-type]


def test_the_true_model_leaves_white_noise(bench_log: BenchLog) -> None:
    problem = bench_problem([bench_log()], load_model(rig=True))
    r = problem.residual({})
    assert np.sqrt(np.mean(r[200:] ** 2)) == pytest.approx(1.0, abs=0.1)
    assert len(problem.rows()) == len(r)


def test_a_linear_estimate_keeps_nominal_figures_within_reach(bench_log: BenchLog) -> None:
    """A log whose commands were lost asked for a negative rise time."""
    problem = bench_problem([bench_log(duration=0.6)], load_model(rig=True))
    names = names_of(problem, {})
    at, mean, width = priors(problem, {}, names)
    none = np.zeros(0)
    linear = Linear(names, at, mean, width, none, none, none, none)
    theta = estimate(problem, linear, at - 40.0 * width)
    assert theta and all(
        theta[name] == pytest.approx(nominal - 8.0 * sigma)
        for name, (nominal, sigma) in problem.nuisance.items()
    )


@pytest.mark.parametrize(
    ("kind", "values"),
    [
        ("hose_lag", {"T": 0.004}),
        ("supply_droop", {"D": 0.05, "T": 0.3}),
        ("valve_delay", {"dt": 0.002}),
        ("pressure_friction", {"mu": 0.04}),
    ],
)
def test_effects_join_by_theta(bench_log: BenchLog, kind: str, values: dict[str, float]) -> None:
    log = bench_log((effect(kind, **values),), seed=3)
    problem = bench_problem([log], load_model(rig=True))
    theta = {f"{kind}.{name}": value for name, value in values.items()}
    with_it, without = problem.residual(theta), problem.residual({})
    assert np.mean(with_it[200:] ** 2) < 1.3
    assert np.mean(without[200:] ** 2) > 2 * np.mean(with_it[200:] ** 2)


@pytest.mark.parametrize("name", ["planning", "plant"])
@pytest.mark.parametrize("sent", [(1.0, 0.0), (0.0, 1.0), (1.0, 1.0)])
def test_a_log_may_begin_with_a_valve_on_for_long(name: str, sent: tuple[float, float]) -> None:
    """Orifices pass the same at any low pressure, so that Newton's steps alone lead nowhere."""
    rig, time = RigModel(load_model(name, rig=True), (), ()), np.arange(200) / 1e3
    still = SmoothedMotion(time, *(np.full(200, x) for x in (0.03, 0.0, 0.0, 0.0)), 0.0)
    extend, retract = ([(-np.inf, np.inf)] if on else [] for on in sent)
    force = rig.predict(still, (extend, retract), {}).force
    assert np.ptp(force) < 0.5
    assert np.abs(force).min() > 40.0


def test_stiff_air_is_predicted_as_it_is_simulated() -> None:
    """The supply line answers within a fifth of a millisecond when its pressures are nearly equal.
    Runge and Kutta's steps of a millisecond are unstable there: 0.8 N off, 2.1 N at worst."""
    model, times = load_model("plant", rig=True), np.arange(600) / 1e3
    x, v = 0.035 + 0.02 * np.sin(9 * times), 0.18 * np.cos(9 * times)
    valves = {"extend": [(0.05, 0.2), (0.3, 0.4)], "retract": [(0.17, 0.33), (0.45, 0.6)]}
    sent = {f"valve/{side}": Profile.pulses(*on) for side, on in valves.items()}
    simulated = drive(model, hermite(times, x, v), sent, times, step=5e-5)["piston/F"]
    motion = SmoothedMotion(times, x, v, np.gradient(v, times), np.zeros(600), 0.0)
    rig = RigModel(model, (), ())
    error = rig.predict(motion, (valves["extend"], valves["retract"]), {}).force - simulated
    assert np.sqrt(np.mean(error**2)) < 0.5
    assert np.abs(error).max() < 1.8


def test_a_delay_has_a_slope(bench_log: BenchLog) -> None:
    problem = bench_problem([bench_log()], load_model(rig=True))
    small = (problem.residual({"valve_delay.dt": 1e-5}) - problem.residual({})) / 1e-5
    large = (problem.residual({"valve_delay.dt": 1e-4}) - problem.residual({})) / 1e-4
    assert np.linalg.norm(small) > 0
    assert np.linalg.norm(small - large) < 0.5 * np.linalg.norm(large)


@pytest.mark.parametrize("shift", [-3e-4, 7e-5, 4e-4])
def test_clocks_that_are_all_late_look_like_none(shift: float, bench_log: BenchLog) -> None:
    """Valves that act earlier and sensors that show everything as much later, also by parts of a
    row: what no log can tell apart must cost the same, or an interval would be too narrow."""
    problem = bench_problem([bench_log(duration=1.5)], load_model(rig=True)).in_detail()
    sensors = ("sensor_delay:piston/x.dt", "sensor_delay:piston/F.dt")
    base = 0.5 * float(np.sum(problem.residual({}) ** 2))

    def rises(*shifted: str) -> float:
        theta = {"valve_delay.dt": -shift, **dict.fromkeys(shifted, shift)}
        return 0.5 * float(np.sum(problem.residual(theta) ** 2)) - base

    assert abs(rises(*sensors)) < 1.0  # nats
    assert rises() > 10.0


def test_switching_instants_merge_when_pulses_overlap() -> None:
    time = np.arange(100) / 1e3
    sent = ((time >= 0.010) & (time < 0.030) | (time >= 0.032)).astype(float)
    acting = delayed(pulses(time, sent), 0.006, 0.010)
    assert acting.tolist() == [[pytest.approx(0.016), np.inf]]
    assert is_on(acting, np.array([0.0159, 0.0161])).tolist() == [0.0, 1.0]


def test_pressures_are_read_when_there_are_any(bench_log: BenchLog) -> None:
    log = bench_log()
    model = load_model(rig=True)
    bare = bench_problem([log], model)
    states = bare.predictor.predict(bare.logs[0], {}).states
    columns = {
        f"{c} [Pa]": absolute_pressure(c, states, model.mechanism.need_cylinder())
        + 500 * np.random.default_rng(0).standard_normal(len(log))
        for c in ("chamber/extend/P", "chamber/retract/P")
    }
    problem = bench_problem([log.with_columns(columns)], model)
    assert problem.channels == ("piston/F", "chamber/extend/P", "chamber/retract/P")
    assert np.sqrt(np.mean(problem.residual({}) ** 2)) == pytest.approx(1.0, abs=0.15)
    assert not problem.contradictions
    swapped = dict(zip(columns, reversed(columns.values()), strict=True))
    (fault,) = bench_problem([log.with_columns(swapped)], model).contradictions
    assert "chamber/extend/P and chamber/retract/P are swapped" in str(fault)


def test_a_pressure_of_states_that_diverge_is_no_warning() -> None:
    """A fit may try a model that is far from the data; what it leaves is refused by its size."""
    states = {"chamber/extend/F": np.array([1.0, 1e307])}
    found = absolute_pressure(
        "chamber/extend/P", states, load_model(rig=True).mechanism.need_cylinder()
    )
    assert np.isfinite(found).tolist() == [True, False]


def test_from_logs_to_a_model_and_the_next_test(bench_log: BenchLog, tmp_path: Path) -> None:
    paths = []
    for seed in range(3):
        log = bench_log((effect("seal_friction", F_c=9.0),), duration=2.0, seed=seed)
        paths.append(tmp_path / f"run_{seed}.csv")
        Trajectory(
            log.time, dict(zip(log.headers, (log[n] for n in log.names), strict=True))
        ).write(paths[-1])
    out = tmp_path / "answer"
    answer, _ = discover_logs(paths[:2], paths[2:], out=out)
    assert answer.added == ("seal_friction",)
    value = answer.ranking[0].parameters["F_c"]
    assert value.low < 9.0 < value.high
    assert answer.error_after < 1.3 < 3.0 < answer.error_before
    written = json.loads((out / "answer.json").read_text())
    assert written["verdict"] == "missing" and written["model"] == str(out / "model.yaml")
    spec = load_spec(out / "model.yaml")
    assert any(e.kind == "seal_friction" for e in spec.effects)

    # what was found is no longer missing
    again, _ = discover_logs(paths, model=str(out / "model.yaml"))
    assert again.verdict == "nothing"

    other = written["ranking"][1]["effect"]
    assert adopt_effect(out, other, tmp_path / "other.yaml").is_file()
    with (
        patch.multiple(DesignSearchSettings, members=5, generations=0),
        patch.multiple(ExperimentSettings, tests=1),
    ):
        proposal = propose(out, tmp_path / "next.yaml")
    assert proposal.nats > 0 and (tmp_path / "next.yaml").is_file()
