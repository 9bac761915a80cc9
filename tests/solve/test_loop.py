"""In which order a trial is repaired, and what a plan that no scenario has seen says."""

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import pytest

from kemba.ocp.certificate.status import Status
from kemba.solve import loop
from kemba.solve.loop import STAGES, TICKS, repaired
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
