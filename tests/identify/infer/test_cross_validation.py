"""Which parts of the logs are left out: runs, or quarters of runs where one run alone shows it."""

from unittest.mock import patch

import numpy as np
import pytest
from toy_problem import Toy

from kemba.identify.discover import discover
from kemba.identify.infer.cross_validation import gained, window_powers
from kemba.identify.infer.search import Search
from kemba.identify.infer.selection import is_unsupported


def test_parts_that_gain_alike_have_the_usual_standard_error() -> None:
    gains = np.array([3.0, -1.0, 2.0, 4.0])
    gain = gained(gains, np.ones(4))
    assert gain.nats == 8.0
    assert gain.error == pytest.approx(2.0 * gains.std(ddof=1))
    assert gained(gains, np.zeros(4)) == gain  # both predict the same


def test_parts_that_gain_what_they_can_show_do_not_scatter() -> None:
    shown = np.array([1.0, 0.0, 8.0, 1.0])
    assert gained(2.0 * shown, shown).error == pytest.approx(0.0, abs=1e-12)
    assert gained(2.0 * shown[::-1], shown).error > 10.0


def one_run_hums(size: float) -> Toy:
    """Four runs; what `hum` is a force of acts in the third one only."""
    problem = Toy({}, runs=4)
    problem._shapes["hum"] = problem._shapes["hum"] * (problem.rows().run == 2)
    problem.measured = problem.measured + size * problem._shapes["hum"]
    return problem


def test_runs_are_left_out_whole() -> None:
    search = Search(Toy({"kick.a": 8.0}, runs=4))
    best = search.run()
    parts = search.base.parts
    assert len(parts) == 16 and len(set(parts.tolist())) == 4
    assert len(window_powers(search, best)) == 4
    assert len(window_powers(search, best, fine=True)) == 16
    assert search.points[best].linear.count.sum() == len(search.problem.rows())
    assert discover(Toy({"kick.a": 8.0}, runs=4)).answer.split_by == "runs"


def test_what_one_run_alone_shows_is_found() -> None:
    answer = discover(one_run_hums(8.0)).answer
    assert answer.verdict == "missing" and answer.added == ("hum",)
    assert answer.split_by == "time blocks"


@pytest.mark.parametrize(("alone", "idle"), [(1.0, True), (0.9, False)])
def test_whole_runs_cannot_confirm_what_one_alone_shows(alone: float, idle: bool) -> None:
    search = Search(one_run_hums(8.0))
    search.start()
    search.visit(("hum",))
    with patch("kemba.identify.infer.cross_validation.ALONE", alone):
        assert is_unsupported(search, ("hum",)) == idle


def test_what_one_run_alone_shows_is_not_found_where_it_is_not() -> None:
    assert discover(one_run_hums(0.0)).answer.verdict == "nothing"
