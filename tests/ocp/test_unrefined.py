"""Plans that could not be refined, and what refined ones say of impacts."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import pytest

from kemba.ocp import refined as rooms
from kemba.ocp.certificate.status import Status
from kemba.ocp.nlp.ending import Ending
from kemba.ocp.refinement.refine import Refined


@dataclass(frozen=True)
class Found:
    """What `on_phases` reads of a plan."""

    task: Any = None
    model: Any = None
    requirements: tuple[Any, ...] = ()
    trajectory: Any = None
    attempts: tuple[Any, ...] = ()
    solve_s: float = 0.0
    solve_cpu_s: float = 0.0
    status: Status = Status.SOLVED
    sentence: str = "solved: apex 0.500 m, 0.7 s"
    refined: bool = False
    cost: dict[str, float] = field(default_factory=dict)


def test_a_plan_that_cannot_be_refined_is_not_solved(monkeypatch: pytest.MonkeyPatch) -> None:
    failed = Refined(None, None, Ending.UNSUITABLE, 3, reason="the model is not made for it")
    monkeypatch.setattr(rooms, "refine", lambda *_, **__: failed)
    session = SimpleNamespace(tell=lambda text: None, control=None, attempts=[])
    kept = rooms.on_phases(SimpleNamespace(session=session), Found())  # type: ignore[arg-type]
    assert kept.status is Status.ACCEPTABLE
    assert kept.sentence.startswith("acceptable: apex 0.500 m, 0.7 s; not refined (the model is")
    assert "refine=none" in kept.sentence and "solved" not in kept.sentence
