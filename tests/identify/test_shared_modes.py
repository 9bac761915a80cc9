"""A poor minimum of one hypothesis does not decide: each begins from what the others found, too."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from twin.cases import bench_case
from twin.measure import Sensors

from kemba.effects import BY_KIND
from kemba.identify.bench.problem import bench_problem
from kemba.identify.discover import discover
from kemba.identify.evidence.modes.shared import better_beginnings
from kemba.identify.evidence.search import Search
from kemba.identify.evidence.spike_slab import NULL
from kemba.identify.logs.reading import read_logs
from kemba.model.spec import load_model
from kemba.trajectory import Trajectory

BenchLog = Callable[..., Trajectory]
FRICTION = ("seal_friction",)


def test_a_hypothesis_begins_where_another_one_fits_better(bench_log: BenchLog) -> None:
    hidden = (BY_KIND["seal_friction"](F_c=8.0),)
    search = Search(bench_problem([bench_log(hidden, duration=1.2)], load_model(rig=True)))
    search.start()
    search.visit(FRICTION)
    points, null = dict(search.points), search.points[NULL]
    assert not search.share_modes()
    assert FRICTION not in better_beginnings(search.problem, points, null)

    mode = points[FRICTION].mode
    poor = {**mode.theta, "valve_delay.dt": 0.01}
    points[FRICTION] = replace(points[FRICTION], mode=replace(mode, theta=poor, cost=1e6))
    begin = better_beginnings(search.problem, points, null)[FRICTION]
    assert begin["seal_friction.F_c"] > 5.0
    assert begin["valve_delay.dt"] == null.mode.theta["valve_delay.dt"]


@pytest.mark.nightly
def test_a_late_force_sensor_is_not_taken_for_inertia(tmp_path: Path) -> None:
    """A case of the blind study whose search ended in a poor minimum."""
    usual = {"figures_off": 0.01, "floor": 0.0, "runs": 4, "duration": 4.0, "sensors": Sensors()}
    case = {"seed": 5148, "size": 1.5, "chambers": "first_order", **usual}
    paths, truth = bench_case(tmp_path, "sensor_delay:piston/F", **case)
    answer = discover(bench_problem(list(read_logs(paths)), load_model(rig=True))).answer
    assert answer.added == ("sensor_delay:piston/F",), answer.sentence
    (row,) = [r for r in answer.ranking if r.effect == "sensor_delay:piston/F"]
    true = truth["effects"][0]["parameters"]["dt"]
    assert row.parameters["dt"].low < true < row.parameters["dt"].high
