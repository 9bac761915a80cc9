"""Parameters that a linear estimate puts where none can be."""

from dataclasses import replace

import numpy as np
import pytest
from toy_problem import Toy

from kemba.identify.infer.cross_validation import within_tolerance
from kemba.identify.infer.null_model import within_bounds
from kemba.identify.infer.search import Search
from kemba.identify.infer.verdict import values

BOTH = ("bend", "drag")  # both follow the same speed: what one lacks the other takes


def searched(largest: float) -> Search:
    """A toy with both effects refitted, of which bend may be `largest` at most."""
    problem = Toy({"bend.a": 8.0, "drag.a": 8.0})
    bend = problem.candidates["bend"]
    problem.candidates["bend"] = replace(bend, lead=replace(bend.lead, upper=largest))
    search = Search(problem)
    search.start()
    search.visit(BOTH)
    return search


def test_estimates_within_bounds_are_as_they_are() -> None:
    point = (search := searched(20.0)).points[BOTH]
    np.testing.assert_array_equal(within_bounds(search.problem, point), point.score.z)


def test_others_move_with_a_parameter_that_is_held_at_its_bound() -> None:
    """As the likeliest ones do, given that one; put back alone it would leave a bad fit."""
    search = searched(6.0)
    point, problem = search.points[BOTH], search.problem
    z, covariance = point.score.z, point.score.covariance
    i = point.linear.index("bend.a")
    assert z[i] > 7.0
    given = z + covariance[:, i] / covariance[i, i] * (6.0 - z[i])
    found = within_bounds(problem, point)
    np.testing.assert_allclose(found, given, atol=1e-4)

    def power(v: np.ndarray) -> float:
        theta = dict(zip(point.linear.names, np.where(np.arange(len(v)) == i, 6.0, v), strict=True))
        return float(np.sum(problem.residual(theta) ** 2))

    assert power(found) < 0.7 * power(z)


def test_what_is_reported_fits_together() -> None:
    search = searched(6.0)
    point = search.points[BOTH]
    free = point.score.z[point.linear.index("drag.a")]
    bend, drag = (values(search, BOTH, name)["a"] for name in BOTH)
    assert bend.value == pytest.approx(6.0, abs=1e-6) and bend.high <= 6.0
    assert drag.value > free + 0.3  # it has to do what bend may not
    assert drag.low < drag.value < drag.high


def test_left_out_data_are_predicted_with_what_a_parameter_can_be() -> None:
    """A fit to the other blocks that leaves the bounds would be judged for what it cannot do."""
    for largest, expected in ((6.0, 6.0), (20.0, 8.0)):
        search = searched(largest)
        linear = search.points[BOTH].linear
        found = within_tolerance(search, linear, BOTH)
        assert found[linear.index("bend.a")] == pytest.approx(expected, abs=0.5)
        assert found[linear.index("bend.a")] <= largest + 1e-9


def test_a_large_effect_does_not_end_at_a_bound() -> None:
    """As a zero that is off by ten times what is usual: nine sizes here, where a slab has 0.7."""
    search = Search(Toy({"bend.a": 90.0}))
    search.start()
    search.visit(("bend",))
    assert search.points[("bend",)].fit.theta["bend.a"] == pytest.approx(90.0, rel=0.03)
