"""Logs in which nothing is missing: coarse, slow, short, late ones, and clocks that are wrong."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
from twin.cases import bench_case
from twin.measure import Sensors

from kemba.effects import BY_KIND
from kemba.errors import KembaError
from kemba.identify.bench.bench_log import prepare
from kemba.identify.bench.clocks import looked_at
from kemba.identify.bench.problem import BenchProblem, bench_problem
from kemba.identify.bench.validate import contradictions
from kemba.identify.logs.gate import limits_of
from kemba.identify.problem.noise import step_of, telling
from kemba.identify.workflow import compare_logs, discover_logs
from kemba.model.spec import load_model
from kemba.trajectory import Array, Trajectory

BenchLog = Callable[..., Trajectory]
Columns = dict[str, Array]
FORCE, POSITION = "piston/F [N]", "piston/x [m]"


def coarse(time: Array, columns: Columns) -> tuple[Array, Columns]:
    return time, columns | {FORCE: 8.0 * np.round(columns[FORCE] / 8.0)}


def slow(time: Array, columns: Columns) -> tuple[Array, Columns]:
    return time[::10], {h: y[::10] for h, y in columns.items()}


def short(time: Array, columns: Columns) -> tuple[Array, Columns]:
    return time[:160], {h: y[:160] for h, y in columns.items()}


def late(time: Array, columns: Columns) -> tuple[Array, Columns]:
    return time, columns | {POSITION: np.interp(time - 0.005, time, columns[POSITION])}


def stretched(time: Array, columns: Columns) -> tuple[Array, Columns]:
    return 1.05 * time, columns


def drifting(rate: float, *headers: str) -> Callable[..., tuple[Array, Columns]]:
    """Columns whose recorder gains on the others: it wrote at t what happened at t (1 - rate)."""

    def change(time: Array, columns: Columns) -> tuple[Array, Columns]:
        happened = time[0] + (time - time[0]) / (1.0 + rate)
        begun = np.searchsorted(time, happened + 1e-9, side="right") - 1
        moved = {
            h: columns[h][begun] if "valve" in h else np.interp(happened, time, columns[h])
            for h in headers
        }
        return time, columns | moved

    return change


VALVES = ("valve/extend [1]", "valve/retract [1]")
late_valves, late_force = drifting(0.003, *VALVES), drifting(0.003, FORCE)
late_position = drifting(0.002, POSITION)


def changed(log: Trajectory, change: Callable[..., tuple[Array, Columns]]) -> Trajectory:
    columns = {h: log[n] for h, n in zip(log.headers, log.names, strict=True)}
    return Trajectory(*change(log.time, columns), log.meta)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "test", "seed", "named"),
    [
        (coarse, "slow", 911, ()),
        (coarse, "opposed", 911, ()),
        (slow, "random", 901, ()),
        (slow, "opposed", 901, ()),
        (short, "random", 902, ()),
        (late, "random", 901, ("sensor_delay:piston/x",)),
        (stretched, "random", 901, ()),
        (late_valves, "random", 901, ()),
        (late_force, "opposed", 902, ()),
        (late_position, "random", 901, ()),
    ],
)
def test_no_effect_is_blamed_for_the_way_a_log_was_taken(
    change: Callable[..., tuple[Array, Columns]],
    test: str,
    seed: int,
    named: tuple[str, ...],
    tmp_path: Path,
) -> None:
    (path,), _ = bench_case(
        tmp_path, None, seed=seed, runs=1, duration=3.0, sensors=Sensors(), tests=(test,)
    )
    changed(Trajectory.read(path), change).write(path)
    answer = discover_logs([path])[0]
    assert (answer.verdict, answer.added) == ("missing" if named else "nothing", named)
    assert answer.error_after < 1.7


@pytest.mark.slow
def test_compare_raises_no_alarm_on_a_short_log(tmp_path: Path) -> None:
    (path,), _ = bench_case(
        tmp_path, None, seed=947, runs=1, duration=1.5, sensors=Sensors(), tests=("opposed",)
    )
    found, _ = compare_logs([path])
    assert found.tolerable and "does not explain" not in found.sentence


def test_readings_that_stand_still_tell_one_thing() -> None:
    moving = 8.0 * np.arange(1, 6)
    values = np.concatenate([np.zeros(50), moving, np.tile([40.0, 48.0], 30)])
    kept = telling(values, sigma=8.0 / np.sqrt(12.0))
    assert kept[:50].sum() == 1 and kept[-60:].sum() == 1
    assert telling(values, sigma=5.0).all()  # noise as large as the steps
    assert step_of(values + 1e-12 * np.arange(len(values))) == pytest.approx(8.0)


def test_a_motion_without_rest_is_no_coarse_sensor() -> None:
    """Its slowest step is none of the sensor's."""
    t = np.arange(0.0, 4.0, 1e-3)
    q = 35.0 * t + 0.3 * np.sin(20.0 * t)
    assert step_of(q) == 0.0
    step, swing = 2 * np.pi / 4096, np.sin(3.0 * t)
    assert step_of(np.round(swing / step) * step) == pytest.approx(step, rel=1e-6)
    written = np.round(np.round(swing / step) * step, 5)  # as a file has it
    assert step_of(written) == pytest.approx(step, rel=0.01)


def test_coarse_sensors_are_told(bench_log: BenchLog) -> None:
    (remark,) = limits_of([changed(bench_log(), coarse)])
    assert remark.startswith("piston/F comes in steps of 8 N") and "noise of 2.3" in remark
    assert not limits_of([bench_log()])


def test_of_a_slow_log_times_within_a_row_are_not_looked_for(bench_log: BenchLog) -> None:
    model = load_model(rig=True)
    usual = bench_problem([bench_log()], model)
    blurred = bench_problem([changed(bench_log(), slow)], model)
    assert "valve_delay" in usual.candidates and "sent:late" not in usual.nuisance
    assert "valve_delay" not in blurred.candidates and not blurred.formulas({})
    assert blurred.nuisance["sent:late"] == (0.0, pytest.approx(0.01 / np.sqrt(12.0)))
    # a command that a row shows was sent since the row before: in the mean half a row earlier
    (run,), (known,) = blurred.logs, usual.logs
    edges, true = (np.array([e for e, _ in log.commands[0] if e > 0]) for log in (run, known))
    assert np.all(np.abs(edges - true) <= 0.00501)


def test_an_odd_rate_makes_the_clock_doubtful(bench_log: BenchLog) -> None:
    (remark,) = limits_of([changed(bench_log(), stretched)])
    assert "set to 1000 Hz" in remark and "5.0 % too long" in remark and "scale: 0.9524" in remark


@pytest.mark.parametrize(
    ("columns", "rate", "owner"),
    [
        (VALVES, 0.004, "the valve commands"),
        pytest.param(VALVES, -0.008, "the valve commands", marks=pytest.mark.slow),
        pytest.param((POSITION,), 0.03, "piston/x", marks=pytest.mark.slow),
    ],
)
def test_two_clocks_that_drift_apart_are_known(
    columns: tuple[str, ...], rate: float, owner: str, bench_log: BenchLog
) -> None:
    problem = bench_problem([changed(bench_log(), drifting(rate, *columns))], load_model(rig=True))
    assert problem.drift == (owner, pytest.approx(rate, rel=0.2))
    (remark,) = problem.validate()
    assert f"the clock of {owner} runs" in remark and ("fast" if rate > 0 else "slow") in remark
    # on one clock the model explains the log nearly as if they had never been apart
    sound = bench_problem([bench_log()], load_model(rig=True))
    assert sound.drift is None and not sound.validate()
    assert np.mean(problem.residual({}) ** 2) < 3.0 * np.mean(sound.residual({}) ** 2)


def test_a_drift_is_looked_for_in_the_first_rows_only(bench_log: BenchLog) -> None:
    log = bench_log(duration=1.0)
    with patch("kemba.identify.bench.clocks.ROWS", 2500):
        found = looked_at([log, log, log, log])
    assert [len(one) for one in found] == [1000, 1000, 500]
    assert [len(one) for one in looked_at([log])] == [1000]


@pytest.mark.slow
def test_a_force_that_drifts_is_a_drift_of_the_commands_where_motion_tells_little(
    bench_log: BenchLog,
) -> None:
    problem = bench_problem([changed(bench_log(), drifting(-0.005, FORCE))], load_model(rig=True))
    assert problem.drift is not None
    owner, rate = problem.drift
    assert rate == pytest.approx(-0.005 if owner == "piston/F" else 0.005, rel=0.2)


def test_what_is_missing_is_no_drift(bench_log: BenchLog) -> None:
    late = bench_log((BY_KIND["hose_lag"](T=0.004), BY_KIND["valve_delay"](dt=0.003)))
    assert bench_problem([late], load_model(rig=True)).drift is None


def test_what_is_left_of_a_drift_is_a_nominal_figure(bench_log: BenchLog) -> None:
    model = load_model(rig=True)
    sound = BenchProblem([prepare("run", bench_log(duration=1.0))], model)
    late = prepare("run", changed(bench_log(duration=1.0), drifting(0.002, *VALVES)))
    moved = BenchProblem([late], model, drift=("the valve commands", 0.0))
    errors = [np.mean(moved.residual({"clock:valve": rate}) ** 2) for rate in (0.0, 0.002, -0.002)]
    assert np.argmin(errors) == 1
    assert moved.nuisance.keys() - sound.nuisance.keys() == {"clock:valve"}


@pytest.mark.slow
@pytest.mark.parametrize("rows", [160, 300])
@pytest.mark.parametrize(("test", "seed"), [("random", 905), ("random", 906), ("opposed", 905)])
def test_of_one_short_stroke_no_effect_is_sure(
    test: str, seed: int, rows: int, tmp_path: Path
) -> None:
    (path,), _ = bench_case(
        tmp_path, None, seed=seed, runs=1, duration=3.0, sensors=Sensors(), tests=(test,)
    )
    log = Trajectory.read(path)
    first = 300  # a moment of rest comes before
    columns = {h: log[n][first : first + rows] for h, n in zip(log.headers, log.names, strict=True)}
    Trajectory(log.time[first : first + rows], columns, log.meta).write(path)
    answer = discover_logs([path])[0]
    assert answer.verdict in ("nothing", "unknown") and not answer.added
    assert all(ranked.probability <= 0.5 for ranked in answer.ranking)


def test_a_short_log_is_undecided_and_says_what_to_record(
    bench_log: BenchLog, tmp_path: Path
) -> None:
    log = bench_log((BY_KIND["seal_friction"](F_c=20.0),), duration=0.4)
    log.write(tmp_path / "short.csv")
    answer = discover_logs([tmp_path / "short.csv"])[0]
    assert answer.verdict == "unknown" and not answer.added and answer.p_value_nothing >= 0.125
    assert "too short to tell what" in answer.sentence
    assert "record at least 0.8 s" in answer.sentence


def test_a_mix_up_in_which_the_model_cannot_be_is_none(bench_log: BenchLog) -> None:
    """A position from the other end leads to negative volumes, in which nothing comes to rest."""
    run = prepare("run", bench_log(duration=0.6))
    force = run.measured["piston/F"]

    def predict(trial: object) -> np.ndarray:
        if trial is not run:
            raise KembaError("model", "its states do not come to rest")
        return force + 20.0

    assert contradictions(run, 0.07, predict) == []


def test_no_lag_is_read_at_the_end_of_the_search(bench_log: BenchLog) -> None:
    run = prepare("run", bench_log(duration=4.0))
    force = run.measured["piston/F"]
    moved = np.interp(run.motion.time + 0.53, run.motion.time, force)
    faults = contradictions(run, 0.07, lambda _: moved)
    assert not any("500 ms" in str(fault) for fault in faults)


def test_times_as_long_as_a_row_are_looked_for_and_shorter_ones_are_not(
    bench_log: BenchLog,
) -> None:
    model, run = load_model(rig=True), prepare("run", bench_log(duration=0.5))

    def times(row: float) -> dict[str, float]:
        problem = BenchProblem((replace(run, seen_within=row),), model)
        found = problem.candidates.items()
        return {n: c.lead.size for n, c in found if c.lead.unit == "s"}

    usual = times(0.0)
    shortest = min(usual, key=usual.__getitem__)
    assert shortest in times(usual[shortest])
    assert shortest not in times(1.001 * usual[shortest])
