"""What the way in which logs were taken costs is said."""

import numpy as np
import pytest

from kemba.identify.logs.gate import limits_of
from kemba.identify.logs.reading import thinned
from kemba.trajectory import Trajectory


def log(step: float, jitter: float = 0.0, kind: str = "robot", *more: str) -> Trajectory:
    rng = np.random.default_rng(0)
    time = step * np.arange(400) + jitter * rng.uniform(-0.5, 0.5, 400)
    return Trajectory(time, {h: np.zeros(400) for h in ("body/z [m]", *more)}, {"kind": kind})


@pytest.mark.parametrize(("step", "said"), [(2e-3, "500 Hz"), (5e-3, "200 Hz")])
def test_a_slow_log_blurs_valve_edges(step: float, said: str) -> None:
    (remark,) = limits_of([log(1e-3), log(step, 0.0, "robot", "front/valve/extend [1]")])
    assert remark.startswith(f"{said} blurs valve edges to {1e3 * step:.0f} ms")


def test_valves_are_named_only_where_there_are_some() -> None:
    (remark,) = limits_of([log(2e-3, 0.0, "drive")])
    assert remark == "500 Hz: time constants below 2 ms do not show"


def test_uneven_rows_are_told() -> None:
    (remark,) = limits_of([log(1e-3, 0.6e-3)])
    assert "unevenly" in remark


def test_pressures_of_a_robot_are_told_not_to_be_used() -> None:
    (remark,) = limits_of([log(1e-3, 0.0, "robot", "front/chamber/extend/P [Pa]")])
    assert "pressures" in remark and "not used" in remark
    assert not limits_of([log(1e-3, 0.0, "bench", "chamber/extend/P [Pa]")])


def test_a_usual_log_needs_no_remark() -> None:
    assert not limits_of([log(1e-3, 2e-5)])


def test_what_a_locked_rod_does_not_show_is_said_unless_another_log_moves() -> None:
    still, moving = (
        log(1e-3).with_columns({"piston/x [m]": 0.035 + np.linspace(0.0, travel, 400)})
        for travel in (0.0, 0.03)
    )
    (remark,) = limits_of([still])
    assert remark.startswith("the rod does not move (piston/x 35 mm): friction, damping and")
    assert limits_of([still, moving]) == []


def test_thinned_logs_keep_every_row_in_which_a_valve_switches() -> None:
    """Of 10 kHz every tenth row, and the one of the edge; of 1 kHz all."""
    time = 1e-4 * np.arange(100)
    sent = (np.arange(100) >= 47).astype(float)
    quick = Trajectory(time, {"body/z [m]": time, "valve/extend [1]": sent})
    found = thinned(quick)
    assert found.time == pytest.approx(1e-4 * np.array([0, 10, 20, 30, 40, 47, 50, 60, 70, 80, 90]))
    slow = Trajectory(10 * time, {"body/z [m]": time})
    assert thinned(slow) is slow
