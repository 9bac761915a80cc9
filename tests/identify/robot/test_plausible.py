"""Logs in which columns are mixed up are refused, and say why."""

import pytest

pytest.importorskip("numba")

from robot_logs import hops

from kemba.identify.logs.gate import BadData
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
