"""What is changed in a plan whose executions miss, and in which order."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from kemba.ocp import load_task
from kemba.plant.execution.fitted_air import FIGURES as FITTED
from kemba.plant.execution.fitted_air import FittedAir
from kemba.report.judging import remedies as module
from kemba.report.judging.remedies import Remedies, RemedySettings

FIGURES = [f"{effect}.{name}" for effect, names in FITTED.items() for name in names]
FITS = [FittedAir(dict.fromkeys(FIGURES, 1.0 - 0.01 * i), 3.0, 1.0) for i in range(1, 9)]


@pytest.fixture(autouse=True)
def one_fit_after_another(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fits without a simulation, each another."""
    left = iter(FITS)
    monkeypatch.setattr(module, "_fitted", lambda plan, task, earlier: next(left))


def executed(late: float, replay: bool = True, table: bool = True, refined: bool = True) -> Any:
    """A plan that lands `late` [s] on the plant; whether it comes true on its model."""
    judged = SimpleNamespace(
        verdicts={"replay": SimpleNamespace(good=replay)},
        replays=replay and table,
        facts={"plant_replay": {"touchdown_error_s": late}},
    )
    plan = SimpleNamespace(refined=refined)
    return SimpleNamespace(judged=judged, plan=plan, motions=None, good=False)


def good() -> Any:
    """A good plan, whose table is a little off."""
    return SimpleNamespace(**vars(executed(0.0)) | {"good": True})


def remedies() -> Remedies:
    return Remedies(load_task("jump.yaml")[0])


def tried(found: Remedies, *plans: Any) -> list[str]:
    """The names of the remedies for one plan after the other."""
    names = []
    for plan in plans:
        found.next(plan)
        names.append(found.now)
    return names


def test_a_late_landing_is_fitted_pressed_and_fitted_again() -> None:
    found = remedies()
    names = tried(found, executed(0.05), executed(0.04), executed(0.03))
    assert names == ["fit", "press", "fit"]
    assert found.asked.landing.air == RemedySettings.current().air
    assert "legs are pressed to their stops in flight (landing.air: 10 ms)" in found.remark


def test_an_early_landing_is_pressed_as_well_but_not_before_a_fit_of_its_own() -> None:
    assert tried(remedies(), executed(-0.05), executed(-0.04)) == ["fit", "press"]
    begun = Remedies(load_task("jump.yaml")[0], FITS[-1])  # from a shipped plan with fitted air
    assert tried(begun, executed(-0.05), executed(-0.04)) == ["fit", "press"]


def test_a_good_plan_gets_its_edges_on_ticks_and_nothing_else() -> None:
    found = remedies()
    assert tried(found, good()) == ["ticks"]
    assert not found.next(good())


def test_between_late_and_early_the_secant_comes_first() -> None:
    found = remedies()
    assert tried(found, executed(0.05), executed(-0.05)) == ["fit", "fit"]
    assert found.fit is not None
    assert found.fit.factors["chamber.F_extend"] == pytest.approx(0.995)  # half the first fit


def test_fits_that_bring_the_landing_no_nearer_end() -> None:
    plans = [executed(0.05), executed(0.04), executed(0.04), executed(0.039)]
    assert tried(remedies(), *plans) == ["fit", "press", "fit", "anew"]


def test_ticks_come_first_and_are_taken_back_where_they_fail() -> None:
    found = remedies()
    assert tried(found, executed(0.05, table=False)) == ["ticks"] and found.ticks
    found.give_up()
    assert tried(found, executed(0.05, table=False)) == ["fit"] and not found.ticks


def test_a_plan_that_fails_on_its_own_model_is_made_from_another_guess_twice() -> None:
    found, plan = remedies(), executed(0.05, replay=False)
    seeds = []
    while found.next(plan):
        assert found.now == "anew" and found.needed
        seeds.append(found.asked.seed)
        found.guess_made()
    assert seeds == [1, 2]
    assert found.asked.guess_noise == 0.0, "only a plan that is to be made has another guess"


def test_with_new_air_the_own_guess_comes_first() -> None:
    found = remedies()
    tried(found, executed(0.05), executed(0.04, replay=False))
    assert found.now == "anew" and found.asked.seed == 0 and found.asked.guess_noise == 0.0
    found.guess_made()
    tried(found, executed(0.04, replay=False))
    assert found.asked.seed == 1, "the same air, so another guess"


def test_a_plan_that_is_not_refined_has_no_remedy() -> None:
    assert not remedies().next(executed(0.05, replay=False, refined=False))


def test_without_a_fit_a_plan_that_comes_true_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """As with `fit_air: false`: what the plant does is no reason to plan otherwise."""
    monkeypatch.setattr(module, "_fitted", lambda plan, task, earlier: None)
    assert not remedies().next(executed(0.05))
