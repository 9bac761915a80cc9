"""Why a task has no plan: what gave way, by how much, and the limits it ran into."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from kemba.config import Document
from kemba.model import Model
from kemba.ocp.infeasibility.diagnostic import Finding, Relax, one_per_wish, relax
from kemba.ocp.infeasibility.elastic import Outcome
from kemba.ocp.infeasibility.limits import active_limits
from kemba.ocp.task.task import Task
from kemba.ocp.transcription.solution import to_trajectory


@dataclass(frozen=True)
class Explanation:
    """A sentence and the wishes to relax. `proven`: it stands whatever the solver said."""

    sentence: str
    relax: tuple[Relax, ...]
    proven: bool


def refusal(findings: Sequence[Finding]) -> Explanation | None:
    """What refuses a task before solving, or None."""
    certain = [f for f in findings if f.certain]
    if not certain:
        return None
    reasons = "; ".join(f.sentence for f in certain)
    relaxed = one_per_wish(r for f in certain for r in f.relax)
    return Explanation(f"cannot be met: {reasons}", relaxed, True)


def explanation(
    task: Task,
    model: Model,
    outcome: Outcome | None,
    findings: Iterable[Finding],
    document: Document,
) -> Explanation | None:
    """What the elastic solve and the checks say after a failed solve; None when they are silent."""
    hints = [f.sentence for f in findings if f.cause or outcome is None or not outcome.short]
    if outcome is None:
        return Explanation("; ".join(hints), (), False) if hints else None
    transcription, Y = outcome.transcription, outcome.point.Y
    trajectory = to_trajectory(transcription, Y)
    limits = active_limits(task, model, trajectory)
    given = one_per_wish(
        relax(document, wish, asked, 1.0 - asked if wish.quantity.binary else asked + by)
        for wish, by, _ in outcome.given
        for asked in [wish.upper if by > 0 else wish.lower]
    )
    if given:
        time = f" within {trajectory.time[-1]:.2f} s"
        wishes = [f"{r}{time * (r is given[0])} ({r.where})" for r in given]
        wishes[0] = f"cannot be met: {wishes[0]}"
        parts = [*wishes, *limits, *hints]
        return Explanation("; ".join(parts), given, True)
    if not (limits or hints):
        return None
    return Explanation("; ".join(["close to a limit", *limits, *hints]), (), False)
