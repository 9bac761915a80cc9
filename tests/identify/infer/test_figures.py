"""Figures that bend the prediction: fitted by bounded steps, where one linear step leads astray."""

from typing import ClassVar

import numpy as np
import pytest

from kemba.effects.pneumatics.supply import SupplyLine
from kemba.identify.infer.null_model import Baseline
from kemba.identify.infer.structure import fitted_figures
from kemba.identify.infer.windows import error_ratio
from kemba.identify.problem.candidates import LINE, by_default, line_candidates
from kemba.identify.problem.problem import Array, Candidate, Parameter, Problem, Rows, Theta
from kemba.model import Model, load_model

TRUE = {"tau": 0.02, "pull": 3.0}
FULL = load_model("plant")
BARE = Model(
    FULL.mechanism, [e for e in FULL.effects if e.kind != LINE], FULL.supply, "without a line"
)


class Filling(Problem):
    """A chamber that fills: y = 100 (1 - exp(-t / tau)), and a steady pull that may be missing."""

    own_figures: ClassVar[dict[str, str]] = {"tau": "tau"}
    runs = ("one", "two")

    def __init__(self) -> None:
        self.nuisance = {"tau": (0.1, 0.03)}
        self.candidates = {
            name: Candidate(name, Parameter("a", "N", 0.0, 2.0)) for name in ("pull", "tilt")
        }
        self._time = np.tile(np.arange(400) / 1e3, 2)
        self.measured = np.zeros(800)
        noise = np.random.default_rng(1).standard_normal(800)
        self.measured = self.residual({"tau": TRUE["tau"], "pull.a": TRUE["pull"]}) + noise

    def limits(self, name: str) -> tuple[float, float]:
        return 0.01, 0.5

    def residual(self, theta: Theta) -> Array:
        tau = np.clip(theta.get("tau", 0.1), 0.01, 0.5)
        y = 100.0 * (1.0 - np.exp(-self._time / tau))
        y = y + theta.get("pull.a", 0.0) + theta.get("tilt.a", 0.0) * self._time
        return np.asarray(y - self.measured)

    def rows(self) -> Rows:
        label = np.full(800, "filling")
        run = np.repeat([0, 1], 400)
        return Rows(run, np.zeros(800, int), self._time, label, label, ("F",), np.ones(800))


def test_a_bounded_fit_holds_where_a_linear_step_runs_off() -> None:
    problem = Filling()
    slope, usual = problem.jacobian({}, ["tau"])[:, 0], problem.residual({})
    linear = 0.1 - float(slope @ usual) / float(slope @ slope)
    assert linear < 0.0  # no time constant at all
    found, figures = fitted_figures(problem)
    assert figures["tau"] == pytest.approx(TRUE["tau"], rel=0.2)  # the pull is not in it yet
    assert error_ratio(found, figures) < 0.2 * error_ratio(problem)


def test_a_fit_stays_within_the_limits_of_a_figure() -> None:
    problem = Filling()
    problem.limits = lambda name: (0.06, 0.5)  # type: ignore[method-assign]
    _, figures = fitted_figures(problem)
    assert figures["tau"] == pytest.approx(0.06, rel=1e-3)


def test_effects_are_searched_about_the_figures_found() -> None:
    problem = Filling()
    base = Baseline(problem, begin=fitted_figures(problem)[1])
    table = {h: e for h, e in base.table.items() if len(h) == 1}
    assert max(table, key=table.__getitem__) == ("pull",)
    z = base.ranker(base.point.linear).score(("pull",)).z
    assert z[base.point.linear.index("pull.a")] == pytest.approx(TRUE["pull"], abs=0.3)


def rates(
    model: Model, line: float, free: tuple[str, ...] = (), p: tuple[float, ...] = ()
) -> dict[str, float]:
    """Rates of the states by name, with the hose at a share `line` of its pressure."""
    node, names = model.build(free), [quantity.name for quantity in model.states.values()]
    q = np.array([0.1, 0.4, 0.05, -0.4, 0.5, 1.4, -1.3])
    levels = {"supply/line/s": line, "supply/tank/s": 1.0}
    s = np.array([levels.get(n, 3e5 if "/P" in n else 0.5) for n in names])
    u = np.array([1.0, 0.0] * 2 + [0.0] * (node.u.numel() - 4))
    given = (q, np.zeros(7), np.zeros(7), s, 0 * s, np.zeros(node.lam.numel()), u, p)
    rest = np.ravel(node.residual(*given)[1].full())  # ds/dt, here 0, minus the rate
    return dict(zip(names, (-rest).tolist(), strict=True))


def test_a_line_is_searched_by_the_reciprocal_of_its_orifice() -> None:
    (line,) = line_candidates(BARE).values()
    free = tuple(line.keys())
    assert free == ("supply_line.r", "supply_line.V")
    a, V = 3.65e-6, 2e-5
    searched = BARE.with_effects([by_default(LINE)])
    found = rates(searched, 0.8, free, (1.0 / a - 1e3, V))
    own = rates(BARE.with_effects([SupplyLine(a=a, V=V)]), 0.8)
    assert found == pytest.approx(own, rel=1e-9)
    # nearly at the tank's pressure: an orifice gives less than the chambers draw, an open line more
    narrow, wide = (
        rates(searched, 0.999, free, (r, V))["supply/line/s"] for r in (1.0 / a - 1e3, 0.0)
    )
    assert narrow < 0.0 < wide


def test_a_line_is_no_candidate_where_there_is_one_or_nobody_tells_its_flow() -> None:
    assert line_candidates(FULL) == {} == line_candidates(load_model("planning"))
