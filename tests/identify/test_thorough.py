"""The best fit of a hypothesis is found from far away, by slopes of every step."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
import pytest

from kemba.errors import KembaError
from kemba.identify.evidence.linear import linearise, time_blocks
from kemba.identify.evidence.modes.thorough import ThoroughFit
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


def fit_of(problem: Problem, *hypothesis: str) -> ThoroughFit:
    linear = linearise(problem, {}, time_blocks(problem))[0]
    return ThoroughFit(problem, hypothesis, linear)


def test_the_best_fit_is_found_from_where_slopes_mislead() -> None:
    found = fit_of(Bent(TRUE), "drag").found({"bend": 3.0})
    assert found.theta["bend"] == pytest.approx(0.3, abs=0.02)
    assert found.theta["drag.F"] == pytest.approx(2.0, abs=0.05)
    pulls = 0.5 * (0.3**2 + (2.0 / 0.7) ** 2)  # nats, of the priors
    assert found.cost == pytest.approx(pulls, rel=0.05)


def test_a_fit_takes_no_more_evaluations_than_asked_for() -> None:
    fit, start = fit_of(Bent(TRUE), "drag"), {"bend": 3.0}
    costs = [fit.found(start, evaluations).cost for evaluations in (1, 3, 12)]
    assert costs[0] == pytest.approx(fit.cost(start))
    assert costs[0] > costs[1] > costs[2]


def test_what_cannot_be_negative_is_absent() -> None:
    found = fit_of(Bent({"bend": 0.3, "drag.F": -2.0})).found({})
    assert "drag.F" not in found.theta


def test_where_nothing_can_be_simulated_the_cost_is_large_and_finite() -> None:
    class Breaking(Bent):
        def residual(self, theta: Theta, runs: Collection[int] | None = None) -> Array:
            if theta.get("bend", 0.0) > 2.0:
                raise KembaError("bend", "cannot be simulated")
            return super().residual(theta, runs)

    fit = fit_of(Breaking(TRUE), "drag")
    assert fit.cost({"bend": 3.0}) > 1e3 * fit.cost(TRUE)
    assert fit.found({"bend": 1.0}).cost == pytest.approx(fit.found({}).cost, rel=0.05)
