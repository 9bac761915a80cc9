"""What a plan that no scenario has seen says."""

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import pytest

from kemba.ocp.certificate.status import Status
from kemba.solve import loop


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
