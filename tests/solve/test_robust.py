"""Robust planning: which plans are tried, and which is taken."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from kemba.ocp import Plan, Task, load_task
from kemba.ocp.certificate.status import Status
from kemba.ocp.planning import plan
from kemba.scenarios.draw import Scenario, scenarios
from kemba.scenarios.share import ScenarioOutcome, outcomes
from kemba.solve.judged import plant_of
from kemba.solve.robust import _Search, gripping, least_grip, lifted, longer, most_robust


@cache
def planned(height: float) -> Plan:
    task, document = load_task("jump.yaml", [f"height={height} m", "duration=0.7 s"])
    return plan(task, document)


def grounds(folder: Path, low: float, count: int = 50) -> list[Scenario]:
    """Scenarios that differ by the friction of the ground alone."""
    path = folder / "slippery.yaml"
    text = f"name: slippery\nvary:\n  effects.contact.mu: {{low: {low}, high: 1}}\n"
    path.write_text(text, encoding="utf-8")
    return scenarios(path, plant_of(planned(0.5).task), count)


@pytest.mark.slow
def test_friction_is_counted_on_as_far_as_the_scenarios_have_it(tmp_path: Path) -> None:
    model = planned(0.5).model
    assert least_grip(model, grounds(tmp_path, 0.5)) == pytest.approx(0.51, abs=0.01)
    assert least_grip(model, grounds(tmp_path, 0.8)) == pytest.approx(0.804, abs=0.01)


@pytest.mark.slow
def test_a_high_jump_leans_on_friction_and_takes_all_its_time(tmp_path: Path) -> None:
    found, cases = planned(0.84), grounds(tmp_path, 0.5)
    first, second = gripping(found, cases), longer(found, cases)
    assert first is not None and first[0].endswith("of the ground's friction")
    assert first[1] == found.task.model_copy(update={"grip": least_grip(found.model, cases)})
    assert second is not None and "0.805 s instead of 0.7 s" in second[0]
    assert second[1].duration == pytest.approx(0.805)
    assert second[1].model_dump(exclude={"duration"}) == found.task.model_dump(exclude={"duration"})


def test_a_low_jump_does_neither(tmp_path: Path) -> None:
    found, cases = planned(0.5), grounds(tmp_path, 0.5)
    assert gripping(found, cases) is None and longer(found, cases) is None


def test_legs_are_lifted_where_the_task_keeps_them_off_the_ground(tmp_path: Path) -> None:
    found, cases = planned(0.5), grounds(tmp_path, 0.5)
    changed = lifted(found, cases)
    assert changed is not None and changed[0] == "with 5 cm more room under knees and hips"
    least = {name: bound.at_least for name, bound in changed[1].bounds.items()}
    assert least == {"body/z": None, "*/knee/z": pytest.approx(0.1), "*/hip/z": pytest.approx(0.08)}
    free = found.task.model_copy(update={"bounds": {}})
    assert lifted(replace(found, task=free, requirements=()), cases) is None


def asked(height: float, count: int, file: Path) -> Task:
    own = {"robust": count, "uncertainties": str(file)}
    return planned(height).task.model_copy(update=own)


def solving(height: float) -> tuple[list[Task], list[Task], object, object]:
    """What was solved and what was changed, and functions that note it: a known plan, no other."""
    solved: list[Task] = []
    changed: list[Task] = []

    def solve(task: Task) -> Plan:
        solved.append(task)
        status = Status.SOLVED if len(solved) == 1 else Status.INFEASIBLE
        return replace(planned(height), task=task, status=status)

    def change(found: Plan, task: Task) -> None:
        changed.append(task)  # and cannot be solved

    return solved, changed, solve, change


def test_a_plan_that_succeeds_often_enough_is_taken_at_once(tmp_path: Path) -> None:
    grounds(tmp_path, 0.6)
    solved, changed, solve, change = solving(0.5)
    found = most_robust(asked(0.5, 4, tmp_path / "slippery.yaml"), solve, change, lambda text: None)
    assert found.succeeds(1.0) and found.share.landed == 4
    assert len(solved) == 1 and not changed


def test_a_plan_that_fails_is_executed_in_all_scenarios_only_where_none_is_better(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    grounds(tmp_path, 0.3)
    counts: list[int | str] = []

    def noted(*given: Any) -> list[ScenarioOutcome]:
        counts.append(len(given[3]))
        return outcomes(*given)

    monkeypatch.setattr("kemba.solve.robust.outcomes", noted)
    _, _, solve, _ = solving(0.84)
    task = asked(0.84, 20, tmp_path / "slippery.yaml")
    found = most_robust(task, solve, lambda *given: counts.append("changed"), lambda text: None)
    assert counts == [15, "changed", "changed", "changed", 5]
    assert found.landed < 1.0 and found.share.n == 20, "what is said is of all"


def test_where_it_falls_other_plans_are_tried(tmp_path: Path) -> None:
    grounds(tmp_path, 0.3)
    solved, changed, solve, change = solving(0.84)
    task = asked(0.84, 6, tmp_path / "slippery.yaml")
    found = most_robust(task, solve, change, lambda text: None)
    assert found.landed < 1.0 and found.share.landed < 6
    assert [t.duration for t in changed] == [pytest.approx(0.805), 0.7, 0.7]
    assert changed[1].bounds != task.bounds, "legs that keep off the ground by more"
    assert changed[2].grip < 1.0, "at last less friction"
    assert [t.seed for t in solved] == [0, 1], "as asked, then from another start"
    assert found.plan.task == task, "the only plan there is"


def test_after_the_deadline_nothing_more_is_tried(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By a clock of our own: over when the first plan is there."""
    grounds(tmp_path, 0.3)
    now = [0.0]
    monkeypatch.setattr("kemba.solve.robust.time.monotonic", lambda: now[0])
    solved, changed, solve, change = solving(0.84)

    def late(task: Task) -> Plan:
        now[0] = 11.0
        return solve(task)

    task = asked(0.84, 6, tmp_path / "slippery.yaml")
    found = most_robust(task, late, change, lambda text: None, deadline=10.0)
    assert found.share is None and len(solved) == 1 and not changed


@pytest.mark.parametrize("status", [Status.INTERRUPTED, Status.LIMIT])
def test_what_is_no_plan_is_not_executed(status: Status) -> None:
    """After an interruption nothing else is tried; after a failure other plans are."""
    nothing: Any = SimpleNamespace(status=status)
    search = _Search(nothing, [], print, deadline=0.0)
    search.take("none", nothing)
    assert search.candidates == [] and search.done is (status is Status.INTERRUPTED)
