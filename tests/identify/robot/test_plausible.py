"""Logs in which columns are mixed up are refused, and say why."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("numba")

from robot_logs import hops
from twin.cases import SHOWING, robot_case
from twin.measure import Sensors

from kemba.identify.logs.gate import BadData
from kemba.identify.logs.reading import read_logs
from kemba.identify.robot.problem import robot_problem
from kemba.model.spec import load_model
from kemba.trajectory import Trajectory


@pytest.fixture(scope="module")
def log() -> Trajectory:
    return hops(runs=1)[0][0]


def test_a_good_log_passes(log: Trajectory) -> None:
    assert robot_problem([log], load_model("planning")).validate() == []


@pytest.mark.parametrize(
    "change",
    [
        lambda t: {"front/hip/q [rad]": -t["front/hip/q"]},
        lambda t: {"front/hip/q [rad]": t["rear/hip/q"], "rear/hip/q [rad]": t["front/hip/q"]},
        lambda t: {"body/z [m]": 0.5 * t["body/z"]},
    ],
    ids=["sign", "swapped", "scaled"],
)
def test_mixed_up_columns_are_refused(log: Trajectory, change: object) -> None:
    spoilt = log.with_columns(change(log))  # type: ignore[operator]
    with pytest.raises(BadData, match=r"foot|moves as no robot"):
        robot_problem([spoilt], load_model("planning")).validate()


def test_a_large_effect_is_no_mix_up(tmp_path: Path) -> None:
    """Pistons that air pushes the faster, the faster they are: 27 times the noise from row to row,
    where sensors are good; faults of sensors explain it to 20 times, and this effect as it is."""
    paths, _ = robot_case(
        tmp_path,
        "quadratic_damping",
        seed=19093,
        size=1.5,
        figures_off=0.01,
        floor=0.03,
        runs=4,
        motions=SHOWING,
        sensors=Sensors(noise=0.5, keep=0.95),
    )
    fast = read_logs(paths[3:])
    assert robot_problem(fast, load_model("planning")).validate() == []
