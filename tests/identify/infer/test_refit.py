"""The nonlinear refit of one hypothesis: the minimum that SciPy finds, and effects at a bound."""

import numpy as np
import pytest
from scipy.optimize import least_squares
from toy_problem import Toy

from kemba.identify.infer.linear import SpikeSlabSettings
from kemba.identify.infer.refit import Frozen, refit
from kemba.identify.problem.problem import Array, Candidate, Parameter, Problem, Rows, Theta


class Lag(Problem):
    """A signal that passes a lag: nonlinear in the effect's time and in the figure `gain`."""

    runs = ("one",)
    curved = ("gain",)

    def __init__(self, late: float) -> None:
        self.nuisance = {"gain": (1.0, 0.05), "slope": (0.0, 0.5)}
        self.candidates = {"lag": Candidate("lag", Parameter("T", "s", 0.0, 5e-3, lower=0.0))}
        self._time = np.arange(600) / 1e3
        self.measured = np.zeros(600)
        noise = np.random.default_rng(3).standard_normal(600)
        self.measured = self.residual({"gain": 1.07, "lag.T": late}) + noise

    def residual(self, theta: Theta) -> Array:
        late = self._time - theta.get("lag.T", 0.0)
        gain, slope = theta.get("gain", 1.0), theta.get("slope", 0.0)
        return np.asarray(200.0 * gain**2 * np.sin(9.0 * late) + slope * late - self.measured)

    def rows(self) -> Rows:
        label = np.full(600, "moving")
        zeros = np.zeros(600, int)
        return Rows(zeros, zeros, self._time, label, label, ("F",), np.ones(600))


class Saturated(Problem):
    """A reading that saturates, where a full Gauss-Newton step from afar leads farther away, and an
    effect `idle` that shows nowhere."""

    runs = ("one",)

    def __init__(self) -> None:
        self.nuisance = {"slope": (0.0, 0.5)}
        self.candidates = {
            name: Candidate(name, Parameter("a", "N", 0.0, 10.0)) for name in ("push", "idle")
        }
        self._time = np.arange(100) / 1e3

    def residual(self, theta: Theta) -> Array:
        reading = 50.0 * np.arctan((theta.get("push.a", 0.0) - 12.0) / 4.0)
        return np.asarray(reading + theta.get("slope", 0.0) * self._time)

    def rows(self) -> Rows:
        label = np.full(100, "moving")
        zeros = np.zeros(100, int)
        return Rows(zeros, zeros, self._time, label, label, ("F",), np.ones(100))


def frozen(problem: Problem) -> Frozen:
    names = tuple(problem.nuisance)
    return Frozen(names, problem.jacobian({}, names))


def test_a_refit_ends_at_the_minimum() -> None:
    problem = Lag(late=0.03)
    found = refit(problem, ("lag",), {}, frozen(problem))
    widths = np.array([0.05, 0.5, SpikeSlabSettings.slab * 5e-3])
    centre = np.array([1.0, 0.0, 0.0])

    def residual(x: Array) -> Array:
        theta = dict(zip(("gain", "slope", "lag.T"), centre + widths * x, strict=True))
        return np.concatenate([problem.residual(theta), x])

    best = least_squares(residual, [0.0, 0.0, 0.1])
    assert found.cost == pytest.approx(best.cost, abs=0.02)
    at = [found.theta[name] for name in ("gain", "slope", "lag.T")]
    assert (np.array(at) - centre) / widths == pytest.approx(best.x, abs=0.02)
    step = 1e-5
    secant = problem.residual({**found.theta, "lag.T": found.theta["lag.T"] + step})
    secant = (secant - problem.residual(found.theta)) / step
    assert found.columns["lag.T"] == pytest.approx(secant, rel=0.05, abs=0.05 * np.ptp(secant))
    curved = problem.jacobian(found.theta, ["gain"])[:, 0]
    assert found.columns["gain"] == pytest.approx(curved, abs=0.01 * np.ptp(curved))


def test_steps_that_lead_farther_away_are_not_taken() -> None:
    problem = Saturated()
    found = refit(problem, ("push",), {"push.a": 30.0}, frozen(problem))
    assert found.theta["push.a"] == pytest.approx(12.0, abs=0.1)


def test_an_effect_that_shows_nowhere_stays_where_its_prior_has_it() -> None:
    problem = Saturated()
    found = refit(problem, ("idle", "push"), {"push.a": 14.0, "idle.a": 20.0}, frozen(problem))
    assert found.theta["idle.a"] == pytest.approx(0.0, abs=0.1)


def test_an_effect_that_only_the_other_sign_would_explain_stays_on_at_its_bound() -> None:
    problem = Lag(late=-0.01)
    found = refit(problem, ("lag",), {}, frozen(problem))
    assert 1e-13 < found.theta["lag.T"] < 1e-6


def test_what_is_linear_takes_one_step() -> None:
    problem = Toy({"drag.a": 30.0})
    asked = []
    plain = problem.residual
    problem.residual = lambda theta: asked.append(dict(theta)) or plain(theta)  # type: ignore[func-returns-value,method-assign,assignment]
    found = refit(problem, ("drag",), {}, frozen(problem))
    assert found.theta["drag.a"] == pytest.approx(30.0, abs=0.2)
    assert len([theta for theta in asked if "drag.a" in theta]) <= 4
