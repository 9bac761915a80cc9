"""Nothing and its rivals fitted anew, where fits at hand are poor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest
from blind import bench

from kemba.effects import BY_KIND
from kemba.identify.bench.problem import bench_problem
from kemba.identify.discover import discover
from kemba.identify.evidence.modes.rivals import fitted_anew, judged_anew, promised
from kemba.identify.evidence.point import LinearisationPoint
from kemba.identify.evidence.search import Search
from kemba.identify.evidence.spike_slab import NULL
from kemba.model.spec import load_model
from kemba.trajectory import Trajectory

BenchLog = Callable[..., Trajectory]
FRICTION, SUPPLY = ("seal_friction",), ("supply_scale",)
USUAL = {"floor": 0.03, "duration": 4.0}
SLOW_FILL = {"seed": 26082, "size": 0.7, "noise": 0.5, "figures_off": 0.02, "runs": 4}
WEAK_SUPPLY = {"seed": 26077, "size": 1.5, "noise": 1.0, "figures_off": 0.01, "runs": 3}


@pytest.fixture
def search(bench_log: BenchLog) -> Search:
    """A search in logs with friction, after its first refits."""
    hidden = (BY_KIND["seal_friction"](F_c=8.0),)
    begun = Search(bench_problem([bench_log(hidden, duration=1.2)], load_model(rig=True)))
    begun.start()
    for hypothesis in (FRICTION, SUPPLY):
        begun.visit(hypothesis)
    return begun


def spoilt(point: LinearisationPoint) -> LinearisationPoint:
    """The point with a mode far from its best fit: a figure that nobody would believe."""
    poor = {**point.mode.theta, "chamber.F_extend": 1.2 * point.mode.theta["chamber.F_extend"]}
    return replace(point, mode=replace(point.mode, theta=poor))


def test_fits_are_found_again_from_poor_modes(search: Search) -> None:
    points = {h: spoilt(p) for h, p in search.points.items()}
    found = fitted_anew(search.base, points, lambda: False)
    for hypothesis, best in found.items():
        assert best.cost < search.points[hypothesis].mode.cost + 1.0
    assert found[FRICTION].theta["seal_friction.F_c"] == pytest.approx(8.0, rel=0.1)


def test_once_the_time_is_over_one_rival_is_fitted(search: Search) -> None:
    told: list[str] = []
    found = fitted_anew(search.base, search.points, lambda: True, told.append)
    assert set(found) == {NULL, FRICTION}
    assert told[0] == "fitting seal_friction anew (1 of 2)"


def test_what_fits_better_stays_likelier(search: Search) -> None:
    found = fitted_anew(search.base, search.points, lambda: False)
    points = judged_anew(search.base, search.points, found)
    assert points[NULL] is search.base.point
    assert points[FRICTION].log_evidence > points[NULL].log_evidence + 100.0
    assert max(points, key=lambda h: points[h].log_evidence) == FRICTION


def test_slopes_at_a_good_fit_promise_little_more(search: Search) -> None:
    assert -1.0 < promised(search.base, search.points[FRICTION]) < 3.0


def test_nothing_is_fitted_anew_where_an_effect_explains_the_error(bench_log: BenchLog) -> None:
    hidden = (BY_KIND["seal_friction"](F_c=8.0),)
    search = Search(bench_problem([bench_log(hidden, duration=1.2)], load_model(rig=True)))
    assert search.run() == FRICTION and not search.thorough


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("effect", "case"),
    [
        ("supply_scale", {"chambers": "first_order", "colour": {"keep": 0.95}, **WEAK_SUPPLY}),
        ("rise_time_scale", {"chambers": "orifice", "pressures": True, **SLOW_FILL}),
    ],
)
def test_an_effect_behind_unbelievable_figures_is_named(effect: str, case: dict) -> None:
    """Cases of the blind studies that were `unknown` and `nothing` at 5 and 7 times the noise."""
    usual = {"effect": effect, "pressures": False, "colour": {}, **USUAL}
    _, make = bench.prepared({**usual, **case})
    answer = discover(make()).answer
    assert answer.added == (effect,), answer.sentence
