"""In which order a trial is repaired, and what a plan that no scenario has seen says."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from kemba.model.lags import with_lags
from kemba.ocp import Plan, load_task
from kemba.ocp.certificate.status import Status
from kemba.ocp.continuation.origin import Origin
from kemba.ocp.planning import Planning
from kemba.solve import loop
from kemba.solve.loop import STAGES, TICKS, Approach, Listener, repaired
from kemba.solve.trial import Motions, Trial


@dataclass(frozen=True)
class Found:
    status: Status
    sentence: str = "solved"


@pytest.mark.parametrize(
    ("status", "share", "said"),
    [(Status.SOLVED, None, True), (Status.SOLVED, 0.9, False), (Status.LIMIT, None, False)],
)
def test_a_plan_that_was_executed_in_no_scenario_says_so(
    status: Status, share: float | None, said: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    best = SimpleNamespace(plan=Found(status), table=None, share=share)
    monkeypatch.setattr("kemba.solve.robust.most_robust", lambda *_: best)
    nothing: Any = SimpleNamespace(tell=print)
    found: Any = loop._most_robust(nothing, nothing, nothing, nothing, 0.0)
    assert found.plan.sentence == f"solved; {loop.UNTRIED}" if said else found.plan is best.plan


def trial(inputs: bool, table: bool, stages: int = 3, repair: str = "") -> Trial:
    """A refined plan whose inputs and table keep to it on its own model, or not."""
    plan: Any = SimpleNamespace(
        refined=True, stages=SimpleNamespace(stages=stages), status=Status.SOLVED, objective=1.0
    )
    verdicts = {
        "replay": SimpleNamespace(good=inputs, share=0.1),
        "table_replay": SimpleNamespace(good=table, share=0.1 if table else 2.0),
    }
    judged: Any = SimpleNamespace(verdicts=verdicts, replays=inputs and table, share=2.0)
    good = inputs and table
    return Trial(plan, {"good": good, "status": "solved"}, Motions(), judged, repair)


@pytest.mark.parametrize(
    ("first", "after", "repairs"),
    [
        (trial(True, True), {}, [""]),  # nothing is left to be improved
        (trial(True, False), {TICKS: (True, True)}, ["", TICKS]),
        (trial(False, False), {STAGES: (True, True)}, ["", STAGES]),
        (trial(False, False), {STAGES: (True, False), TICKS: (True, True)}, ["", STAGES, TICKS]),
        (trial(False, True), {STAGES: (False, True)}, ["", STAGES]),  # too sensitive all the same
        (trial(False, False), {}, [""]),  # no solution with more stages
        (trial(False, False, stages=5), {}, [""]),  # there are no more
    ],
)
def test_what_misses_says_what_is_repaired(
    first: Trial,
    after: dict[str, tuple[bool, bool]],
    repairs: list[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def again(old: Any, planning: Any, name: str, ticks: bool = False, finer: bool = False) -> Any:
        return after.get(TICKS if ticks else STAGES)

    def executed(plan: Any, execution: Any, repair: str) -> Trial:
        return trial(*plan, stages=5, repair=repair)

    monkeypatch.setattr(loop, "_again", again)
    monkeypatch.setattr(loop, "executed", executed)
    planning: Any = SimpleNamespace(over=False)
    execution: Any = SimpleNamespace(tell=lambda _: None)
    assert [each.repair for each in repaired(first, planning, execution)] == repairs


def test_the_air_of_the_simulated_robot_is_put_in_the_place_of_that_of_the_model() -> None:
    planning = Planning.of(*load_task("jump", ["model=hound", "start.fore/foot/x=0.29 m"]))
    assert with_lags(planning.planner.model) is None
    found = loop.in_physical_air(planning)
    assert found is not None
    assert found.planner.task.model == "hound+orifice"
    assert with_lags(found.planner.model) is not None
    assert found.planner.model.mechanism.legs == planning.planner.model.mechanism.legs
    assert found.planner.session is planning.planner.session  # one time limit, one count


@pytest.mark.parametrize("changed", ["plant=own", "effects.mode_damping.c_none=60 N.s.m-1"])
def test_where_it_has_no_place_the_air_stays(
    changed: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.yaml").write_text("base: plant\n")
    planning = Planning.of(*load_task("jump", [changed.replace("own", "own.yaml")]))
    assert loop.in_physical_air(planning) is None


@pytest.mark.parametrize("leans", [True, False])
def test_after_a_plan_that_leans_on_its_air_every_other_one_has_that_of_the_simulated_robot(
    leans: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried: Any = []
    physical: Any = SimpleNamespace()
    again = [Found(Status.SOLVED, "again"), Found(Status.SOLVED, "and again")]
    monkeypatch.setattr(loop, "in_turn", lambda planning, old, guesses_first: iter(again))
    monkeypatch.setattr(loop, "in_physical_air", lambda planning: physical)
    found = [Found(Status.SOLVED, name) for name in ("first", "second", "third", "fourth")]
    planner = SimpleNamespace(task=SimpleNamespace(robust=0))
    plans: Any = {"document": None, "plans": lambda origin: iter(found)}
    planning: Any = SimpleNamespace(
        planner=planner, clock=SimpleNamespace(wall=1.0), over=False, **plans
    )
    said = []
    for _, one in loop._candidates(planning, tried, Approach(cold=True), Listener(), 0.0):
        said.append(one.plan.sentence)
        tried.append(SimpleNamespace(leans_on_air=leans, plan=one.plan))
    last = ["second", "third", "fourth"]
    assert said == ["first", *(["again", "second", "and again", *last[1:]] if leans else last)]


@pytest.mark.parametrize("guesses_first", [True, False])
def test_the_plan_with_other_air_is_continued_before_guesses_where_time_is_short(
    guesses_first: bool,
) -> None:
    """Guesses are made when they are asked for, and the old plan is continued then, too."""
    made: list[str] = []

    def guesses() -> Iterator[Any]:
        made.append("guess")
        yield SimpleNamespace(sentence="guess")

    def continued(origin: Origin) -> tuple[Any, str]:
        made.append("continued")
        return (replace(old, sentence="continued") if origin.plan is old.trajectory else None), ""

    nothing: Any = None
    at: Any = "where it is"
    old = Plan(nothing, nothing, (), at, nothing, Status.SOLVED, "old", {}, 0, 0)
    planning: Any = SimpleNamespace(plans=guesses, continued=continued, over=False)
    first = next(loop.in_turn(planning, old, guesses_first))
    assert made == ["guess" if guesses_first else "continued"] == [first.sentence]
