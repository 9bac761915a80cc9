"""Why a task has no plan: violated requirements, by how much, and the limits reached."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from kemba.config import Document
from kemba.model import Model
from kemba.ocp.infeasibility.diagnostic import Diagnostic, Relax, one_per_requirement, relax
from kemba.ocp.infeasibility.elastic import Outcome
from kemba.ocp.infeasibility.limits import active_limits
from kemba.ocp.task.task import Task
from kemba.ocp.transcription.solution import to_trajectory


@dataclass(frozen=True)
class Explanation:
    """A sentence and the requirements to relax. `proven`: it does not depend on the
    solver."""

    sentence: str
    relax: tuple[Relax, ...]
    proven: bool


def refusal(diagnostics: Sequence[Diagnostic]) -> Explanation | None:
    """What refuses a task before solving, or None."""
    certain = [f for f in diagnostics if f.certain]
    if not certain:
        return None
    reasons = "; ".join(f.sentence for f in certain)
    relaxed = one_per_requirement(r for f in certain for r in f.relax)
    return Explanation(f"cannot be met: {reasons}", relaxed, True)


def explanation(
    task: Task,
    model: Model,
    outcome: Outcome | None,
    diagnostics: Iterable[Diagnostic],
    document: Document,
) -> Explanation | None:
    """What the elastic solve and the checks say after a failed solve; None when they are silent."""
    hints = [f.sentence for f in diagnostics if f.cause or outcome is None or not outcome.short]
    if outcome is None:
        return Explanation("; ".join(hints), (), False) if hints else None
    transcription, Y = outcome.transcription, outcome.point.Y
    trajectory = to_trajectory(transcription, Y)
    limits = active_limits(task, model, trajectory)
    given = one_per_requirement(
        relax(
            document, requirement, asked, 1.0 - asked if requirement.quantity.binary else asked + by
        )
        for requirement, by, _ in outcome.given
        for asked in [requirement.upper if by > 0 else requirement.lower]
    )
    if given:
        time = f" within {trajectory.time[-1]:.2f} s"
        requirements = [r.placed(time * (r is given[0])) for r in given]
        requirements[0] = f"cannot be met: {requirements[0]}"
        if transcription.task.landing != task.landing:
            requirements.append("`landing` is not counted in this and may ask for still less")
        parts = [*requirements, *limits, *hints]
        return Explanation("; ".join(parts), given, True)
    if not (limits or hints):
        return None
    return Explanation("; ".join(["close to a limit", *limits, *hints]), (), False)
