"""A part of the answer is right where it acts, however much of the error sits elsewhere."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from toy_problem import Toy

from kemba.identify.discover import discover
from kemba.identify.problem.problem import Array, Theta


class Plain(Toy):
    """No formula is tried."""

    def formulas(self, theta: Theta) -> Mapping[str, Array]:
        return {}


def hums_early(disturbed: slice, kick: float = 0.0) -> Toy:
    """What `hum` is a force of acts in the first 0.3 s of each run; an unknown one, many times as
    large as the noise, in the rows `disturbed` of each."""
    problem = Plain({"kick.a": kick})
    t = problem._time
    problem._shapes["hum"] = problem._shapes["hum"] * (t < 0.3)
    problem.measured = problem.measured + 9.0 * problem._shapes["hum"]
    beat = np.zeros(800)
    beat[disturbed] = 40.0 * np.sin(300.0 * np.arange(800)[disturbed] / 1e3 + 0.5)
    problem.measured = problem.measured + np.tile(beat, len(problem.runs))
    return problem


def test_an_effect_that_is_right_where_it_acts_is_named() -> None:
    answer = discover(hums_early(slice(400, 800))).answer
    assert answer.verdict == "partly" and answer.added == ("hum",)
    assert answer.error_after > 0.9 * answer.error_before > 10.0
    value = answer.ranking[0].parameters["a"]
    assert value.value == pytest.approx(9.0, rel=0.1)


def test_a_second_effect_that_is_right_where_it_acts_is_named_too() -> None:
    """What is left where it does not act is a hundred times what it explains."""
    answer = discover(hums_early(slice(400, 800), kick=60.0)).answer
    assert set(answer.added) == {"hum", "kick"}


def test_an_effect_that_leaves_an_error_where_it_acts_is_not() -> None:
    answer = discover(hums_early(slice(0, 400))).answer
    assert answer.verdict == "unknown" and answer.added == ()
