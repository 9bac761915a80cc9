"""The best fits to which blind studies compare misses are found from far away."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
import pytest
from blind import thorough

from kemba.identify.evidence.linear import Linear, linearise, time_blocks
from kemba.identify.problem.problem import Array, Candidate, Parameter, Problem, Rows, Theta

ROWS, SIZE = 400, 30.0  # SIZE: sigmas, of all rows together
TRUE = {"bend": 0.3, "drag.F": 2.0}


class Bent(Problem):
    """A force that is the arc tangent of a figure, and a drag that cannot be negative; no noise."""

    runs = ("run",)

    def __init__(self, truth: Theta) -> None:
        self.nuisance = {"bend": (0.0, 1.0)}
        self.candidates = {"drag": Candidate("drag", Parameter("F", "N", 0.0, 1.0, 0.0))}
        self.measured = np.zeros(ROWS)
        self.measured = self.residual(truth)

    def residual(self, theta: Theta, runs: Collection[int] | None = None) -> Array:
        bent = np.arctan(3.0 * theta.get("bend", 0.0)) * np.ones(ROWS)
        drag = theta.get("drag.F", 0.0) * np.sign(np.sin(np.arange(ROWS)))
        return SIZE / np.sqrt(ROWS) * (bent + drag) - self.measured

    def rows(self, runs: Collection[int] | None = None) -> Rows:
        run, label = np.zeros(ROWS, int), np.full(ROWS, "moving")
        return Rows(run, run, 1e-3 * np.arange(ROWS), label, label, ("F",), np.ones(ROWS))


def linear_of(problem: Problem) -> Linear:
    return linearise(problem, {}, time_blocks(problem))[0]


def test_the_best_fit_is_found_from_where_slopes_mislead() -> None:
    problem = Bent(TRUE)
    found = thorough.best(problem, ("drag",), linear_of(problem), [{"bend": 3.0}])
    assert found.theta["bend"] == pytest.approx(0.3, abs=0.02)
    assert found.theta["drag.F"] == pytest.approx(2.0, abs=0.05)
    pulls = 0.5 * (0.3**2 + (2.0 / 0.7) ** 2)  # nats, of the priors
    assert found.cost == pytest.approx(pulls, rel=0.05)


def test_the_best_of_several_beginnings_counts() -> None:
    problem = Bent(TRUE)
    starts = [{"bend": 3.0}, dict(TRUE)]
    both = thorough.best(problem, (), linear_of(problem), starts).cost
    each = [thorough.best(problem, (), linear_of(problem), [start]).cost for start in starts]
    assert both == min(each)


def test_what_cannot_be_negative_is_absent() -> None:
    problem = Bent({"bend": 0.3, "drag.F": -2.0})
    found = thorough.best(problem, (), linear_of(problem), [{}])
    assert "drag.F" not in found.theta
