"""Where the gate draws its lines: how many readings that cannot be, or are missing, it bears."""

import numpy as np
import pytest

from kemba.identify.logs.gate import BadData, check_logs
from kemba.trajectory import Trajectory

ROWS = 1000


def bench_log(**columns: np.ndarray) -> Trajectory:
    """A bench log in which the piston moves, valves switch and nothing is wrong, but `columns`."""
    time = np.arange(ROWS) / 1e3
    rng = np.random.default_rng(0)
    good = {
        "piston/x": 0.035 + 0.02 * np.sin(6 * time) + 1e-5 * rng.standard_normal(ROWS),
        "valve/extend": (np.sin(20 * time) > 0).astype(float),
        "valve/retract": np.zeros(ROWS),
        "piston/F": 100 * np.sin(9 * time) + rng.standard_normal(ROWS),
    }
    units = {"piston/x": "m", "piston/F": "N"}
    named = {f"{n} [{units.get(n, '1')}]": columns.get(n, y) for n, y in good.items()}
    more = {n: y for n, y in columns.items() if n not in good}
    return Trajectory(time, named | more, {"kind": "bench", "name": "log", "stroke": 0.07})


def spoilt(name: str, value: float, count: int) -> np.ndarray:
    """A good column with `count` readings spread over it that are `value`."""
    column = bench_log()[name].copy()
    column[np.linspace(100, 900, count).astype(int)] = value
    return column


def test_a_good_log_passes() -> None:
    assert check_logs([bench_log()]) == []


@pytest.mark.parametrize("name,value", [("piston/F", 1e4), ("piston/x", 0.12)])
@pytest.mark.parametrize("count", [3, 10, 100])
def test_more_than_two_in_a_thousand_that_cannot_be_are_refused(
    name: str, value: float, count: int
) -> None:
    words = rf"log:102:\d: {name}.*cannot be \({count} rows\)"
    with pytest.raises(BadData, match=words):
        check_logs([bench_log(**{name: spoilt(name, value, count)})])


def test_a_robot_may_turn_over() -> None:
    """A backflip's pitch is a full turn; in degrees it is refused."""
    turn = np.linspace(0.0, -2 * np.pi, ROWS)
    assert check_logs([bench_log(**{"body/pitch [rad]": turn})]) == []
    with pytest.raises(BadData, match="is it in degrees"):
        check_logs([bench_log(**{"body/pitch [rad]": np.degrees(turn)})])


@pytest.mark.parametrize("count", [1, 2])
def test_two_in_a_thousand_are_borne(count: int) -> None:
    assert check_logs([bench_log(**{"piston/F": spoilt("piston/F", 1e4, count)})]) == []


@pytest.mark.parametrize(("count", "borne"), [(50, True), (60, False), (150, False)])
def test_a_channel_that_is_not_needed_may_fail_one_time_in_twenty(count: int, borne: bool) -> None:
    pressure = np.full(ROWS, 3e5) + np.random.default_rng(1).normal(0, 1e3, ROWS)
    pressure[np.linspace(0, ROWS - 1, count).astype(int)] = 3.0  # bar, among pascals
    log = bench_log(**{"chamber/extend/P [Pa]": pressure})
    if borne:
        assert check_logs([log]) == []
    else:
        with pytest.raises(BadData, match="is it in bar"):
            check_logs([log])


@pytest.mark.parametrize(("share", "borne"), [(0.28, True), (0.32, False)])
def test_up_to_three_in_ten_readings_may_be_missing(share: float, borne: bool) -> None:
    force = bench_log()["piston/F"].copy()
    force[np.random.default_rng(2).permutation(ROWS)[: int(share * ROWS)]] = np.nan
    log = bench_log(**{"piston/F": force})
    if borne:
        assert check_logs([log]) == [f"log: piston/F: {int(share * ROWS)} readings missing"]
    else:
        with pytest.raises(BadData, match=f"{100 * share:.0f} % of its readings are missing"):
            check_logs([log])
