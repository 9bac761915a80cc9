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
from kemba.plant.execution.fitted_air import FittedAir
from kemba.plant.execution.retiming import retimed
from kemba.report.judging.judged import Judged, judged
from kemba.settings import Settings, setting
from kemba.stopwatch import Tell
from kemba.trajectory import Trajectory

if TYPE_CHECKING:
    from kemba.scenarios.share import Share

Begun = Callable[[Trajectory], None]


class TableSettings(Settings):
    """When the table of a good plan is worth another plan with valve edges on its ticks."""

    well: float = setting(
        0.5, "1", "of what is allowed: 1 mm of apex, 1.5 ms of touchdown by default",
        "derived: apex within 1 mm is asked of tables from 0.36 to 0.9 m",
    )  # fmt: skip


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
    def misses(self) -> float:
        """The largest error in units of what is allowed; 0 where the plan is good and its table
        well within that."""
        if self.judged is None:
            return 0.0
        if not self.good:
            return self.judged.share
        table = self.judged.verdicts["table_replay"].share
        return table if table > TableSettings.current().well else 0.0

    @property
    def fine(self) -> bool:
        """Whether nothing is left to be improved."""
        return self.good and self.misses == 0.0

    @property
    def rank(self) -> tuple[bool, bool, bool, float, float]:
        """Better ones are greater: good, a plan at all, true on its own model; by what executions
        miss; by cost."""
        found = self.plan
        cost = objective(found.model, found.task, found.requirements, found.trajectory)
        replays = self.judged is not None and self.judged.replays
        return self.good, found.status.plan, replays, -self.misses, -cost


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
    known = None
    if share is None:
        near = retimed(found.model, found.trajectory, table)
        table, known = near.table, near.replay
    done: Judged | None = None
    try:
        done = judged(found, table, tell=tell, known=known)
        result |= {**done.facts, **_confirmed(found, done)}
    except KembaError as error:  # a model that the simulator cannot execute still has its plan
        result |= _unconfirmed(found, f"it cannot be simulated: {error}")
    if found.fitted_air:
        fit = FittedAir(**found.fitted_air)
        result |= {"fitted_air": fit.summary(), "sentence": f"{result['sentence']}; {fit.sentence}"}
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
