"""How far a parameter is moved for its column: a size, but a time by one row."""

import numpy as np
import pytest

from kemba.identify.problem.problem import (
    Array,
    Candidate,
    Parameter,
    Problem,
    Rows,
    Theta,
    mean_slope,
)

ROW = 1e-3  # s
EDGES = (0.0505, 0.1205, 0.3105)  # s, between two rows


class Edges(Problem):
    """A signal that rises at each edge, `late` by a delay, and a force that bends."""

    runs = ("only",)

    def __init__(self, size: float = 5e-3, row: float = ROW, least: float = -np.inf) -> None:
        self.nuisance = {"gain": (1.0, 0.02)}
        self.candidates = {
            "late": Candidate("late", Parameter("T", "s", 0.0, size, least)),
            "bend": Candidate("bend", Parameter("F", "N", 0.0, 10.0, 0.0)),
        }
        self._time = np.arange(0.0, 0.4, row)
        self._row = row

    def residual(self, theta: Theta) -> Array:
        since = self._time[:, None] - np.array(EDGES) - theta.get("late.T", 0.0)
        high = np.clip(since / self._row + 0.5, 0.0, 1.0).sum(axis=1)  # each row is a mean
        return np.asarray(100.0 * high + theta.get("bend.F", 0.0) ** 2)

    def rows(self) -> Rows:
        n, nought = len(self._time), np.zeros(len(self._time), dtype=int)
        label = np.full(n, "")
        return Rows(nought, nought, self._time, label, label, ("F",), np.ones(n))


def column(problem: Problem, name: str) -> Array:
    return np.asarray(problem.jacobian({}, [name])[:, 0])


@pytest.mark.parametrize("size", [2.5e-3, 5e-3, 10e-3])
def test_the_column_of_a_delay_tells_of_short_delays_whatever_its_size_is(size: float) -> None:
    problem, short = Edges(size), 0.3 * ROW
    early, late = (problem.residual({"late.T": by}) for by in (-short, short))
    assert problem.interval == pytest.approx(ROW)
    # a row after an edge for a delay, a row before it for the opposite: the mean of both secants
    change = 0.5 * (late - early) / short
    assert column(problem, "late.T") == pytest.approx(change, abs=1e-6 * np.abs(change).max())


def test_a_delay_shorter_than_a_row_is_moved_by_its_size() -> None:
    steps = [h for _, h in Edges(5e-3, row=0.02).steps({}, "late.T")]
    assert steps == [5e-3, -5e-3]


def test_a_time_constant_is_moved_to_its_shortest_at_least() -> None:
    (step,) = (h for _, h in Edges(row=1e-4, least=6e-4).steps({}, "late.T"))
    assert step == 6e-4


def test_other_effects_are_moved_by_their_size() -> None:
    assert column(Edges(), "bend.F") == pytest.approx(10.0)  # 10 N squared, over 10 N


def test_a_step_to_where_nothing_can_be_predicted_is_left_out() -> None:
    """A length that leaves no volume to the air on one side would count 1e16 sigmas."""
    base, there = np.array([1.0, 2.0]), [(np.array([2.0, 4.0]), 0.5), (np.array([0.0, 1e16]), -0.5)]
    np.testing.assert_allclose(mean_slope(base, there), [2.0, 4.0])
    np.testing.assert_allclose(mean_slope(base, [(there[0][0], h) for h in (0.5, -0.5)]), 0.0)
    broken = [(np.array([np.nan, 0.0]), 0.5), (np.array([np.inf, 0.0]), -0.5)]
    np.testing.assert_allclose(mean_slope(base, broken), 0.0)
