"""A slow drift of a sensor is no force: a formula must explain more than a drift does."""

from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
from twin.cases import bench_case
from twin.measure import Sensors

from kemba.identify.bench.problem import bench_problem
from kemba.identify.infer.formula import Formula, drift_columns, look
from kemba.identify.infer.linear import NULL
from kemba.identify.infer.search import Search
from kemba.identify.logs.reading import read_logs
from kemba.model.spec import load_model
from kemba.trajectory import Trajectory

BenchLog = Callable[..., Trajectory]


def test_the_columns_have_the_variance_of_their_sensor(bench_log: BenchLog) -> None:
    problem = bench_problem([bench_log(), bench_log(duration=1.0, seed=1)], load_model(rig=True))
    columns, widths = drift_columns(problem)
    rows = problem.rows()
    variance = np.sum((columns * widths) ** 2, axis=1)
    for run in np.unique(rows.run):
        assert np.mean(variance[rows.run == run]) == pytest.approx(1.0, rel=0.05)
    with patch("kemba.identify.problem.noise.DRIFT", 3.0):
        assert drift_columns(problem)[1] == pytest.approx(3.0 * widths)


def test_a_drift_is_no_formula(tmp_path: Path) -> None:
    sensors = Sensors(noise=2.0, keep=0.7, drift=1.0)
    options = {"seed": 5163, "figures_off": 0.02, "floor": 0.0, "runs": 3, "duration": 4.0}
    paths, _ = bench_case(tmp_path, None, sensors=sensors, chambers="first_order", **options)
    logs = list(read_logs(paths))
    assert _formula(logs) is None
    with patch("kemba.identify.problem.noise.DRIFT", 1e-6):
        assert _formula(logs) is not None
    for log in logs:
        log.columns["piston/F [N]"] -= 400.0 * (log.columns["piston/x [m]"] - 0.035)
    assert "x - 0.035" in str(_formula(logs))


def _formula(logs: list[Trajectory]) -> Formula | None:
    search = Search(bench_problem(logs, load_model(rig=True)))
    search.start()
    return look(search, NULL)
