"""Logs in which nothing is missing: coarse, slow, short, late ones, and clocks that are wrong."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from twin.cases import bench_case
from twin.measure import Sensors

from kemba.identify.bench.bench_log import prepare
from kemba.identify.bench.problem import bench_problem
from kemba.identify.bench.validate import contradictions
from kemba.identify.compare_logs import compare_logs
from kemba.identify.logs.limits import limits_of
from kemba.identify.problem.quantisation import step_of, telling
from kemba.identify.workflow import discover_logs
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


def test_no_lag_is_read_at_the_end_of_the_search(bench_log: BenchLog) -> None:
    run = prepare("run", bench_log(duration=4.0))
    force = run.measured["piston/F"]
    moved = np.interp(run.motion.time + 0.53, run.motion.time, force)
    faults = contradictions(run, 0.07, lambda _: moved)
    assert not any("500 ms" in str(fault) for fault in faults)
