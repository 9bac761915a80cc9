"""A plan with its controller table, executed on its own model and on the plant, and judged."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from kemba.errors import KembaError
from kemba.ocp import Plan, controller_table
from kemba.ocp.certificate.objective import objective
from kemba.ocp.certificate.status import Status
from kemba.ocp.report import answer, sentence_of
from kemba.plant.execution.counterpart import another_robot
from kemba.plant.execution.retiming import retimed
from kemba.report.judging.judged import Judged, judged
from kemba.stopwatch import Tell
from kemba.trajectory import Trajectory

if TYPE_CHECKING:
    from kemba.scenarios.share import Share

    # a plan; where it was executed in scenarios, with its table and its share of successes
    Candidate = tuple[Plan, Trajectory | None, Share | None]

Begun = Callable[[Trajectory], None]


@dataclass(frozen=True)
class Motions:
    """What is written beside the plan: the controller's table, and the motion of the plant."""

    table: Trajectory | None = None
    plant: Trajectory | None = None


@dataclass(frozen=True)
class Executed:
    """A plan, its entries in the JSON with those of its executions, what is written, and how the
    executions were judged where there were any."""

    plan: Plan
    result: dict[str, Any]
    motions: Motions
    judged: Judged | None = None

    @property
    def good(self) -> bool:
        """Whether it is solved and its executions confirm it."""
        return bool(self.result["good"])

    @property
    def rank(self) -> tuple[bool, bool, bool, float]:
        """Better ones are greater: good, a plan at all, true on its own model, by cost."""
        found = self.plan
        cost = objective(found.model, found.task, found.requirements, found.trajectory)
        replays = self.judged is not None and self.judged.replays
        return self.good, found.status.plan, replays, -cost


def executed(
    found: Plan,
    table: Trajectory | None,
    share: Share | None,
    replay: bool,
    tell: Tell,
    begun: Begun,
    place: str = "",
) -> Executed:
    """A plan with its table and, if `replay`, its executions; `begun` gets it before these.

    `place`: the run folder in the answer.
    """
    result = answer(found, place)
    if table is None and found.attempts:
        table = controller_table(found.model, found.trajectory, found.task.hold)
    if table is not None:
        begun(found.trajectory)
    if table is None or not replay or not found.status.plan:
        return Executed(found, result, Motions(table))
    tell("replay: the times of controller.csv")
    if share is None:
        table = retimed(found.model, found.trajectory, table)
    done: Judged | None = None
    try:
        done = judged(found, table, tell=tell)
        result |= {**done.facts, **_confirmed(found, done)}
    except KembaError as error:  # a model that the simulator cannot execute still has its plan
        result |= _unconfirmed(found, f"it cannot be simulated: {error}")
    if share is not None:
        result |= {"robust": share.summary()}
        result["sentence"] += f"; {share.sentence}"
    return Executed(found, result, Motions(table, done.motion if done else None), done)


def _confirmed(found: Plan, done: Judged) -> dict[str, Any]:
    """What the executions of a plan change in the answer: it stays solved only if all of them come
    near enough."""
    task, judgements = found.task, done.verdicts.values()
    other = another_robot(task.model, task.plant)
    names = [f"the plant is another robot, {other}, which {task.plant} names"] if other else []
    matches = [verdict.sentence for verdict in judgements if verdict.good]
    if done.good:
        return {"sentence": "; ".join([sentence_of(found), *names, *matches])}
    causes = [verdict.sentence for verdict in judgements if not verdict.good]
    return _unconfirmed(found, " and ".join(causes), [*names, *matches])


def _unconfirmed(found: Plan, cause: str, remarks: Sequence[str] = ()) -> dict[str, Any]:
    """Status and sentence of a plan that its executions do not confirm: it is not solved, even
    where it fulfils its own equations."""
    if found.status is Status.SOLVED:
        what = found.sentence.removeprefix("solved: ")
        parts = [f"FAILED: a plan was found, but {cause}", *remarks, f"the plan: {what}"]
    else:
        parts = [sentence_of(found), cause, *remarks]
    return {"status": Status.ACCEPTABLE, "good": False, "sentence": "; ".join(parts)}
