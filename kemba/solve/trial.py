"""A trial: a plan with its controller table, executed and judged, and its score."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from kemba.errors import KembaError, enumerated
from kemba.model import load_spec
from kemba.model.lags import with_lags
from kemba.ocp import Plan, controller_table
from kemba.ocp.certificate.status import Status
from kemba.ocp.phases.radau import RADAU9
from kemba.ocp.planned import answer, sentence_of, warnings
from kemba.plant.repeat import another_robot, carried_over, lacking
from kemba.plant.retiming import retimed
from kemba.plant.simulate import wait_for_compiler
from kemba.scenarios.share import Share
from kemba.solve.judged import Judged, judged
from kemba.stopwatch import Tell, silent
from kemba.trajectory import Array, Trajectory

AIR = "the simulated robot has physical chambers, and this plan's model has first-order ones"
WELL = 0.5  # of what is allowed: a table that misses by more is worth edges on ticks


@dataclass(frozen=True)
class TrialOrder:
    """How plans are executed: whether they are at all, who is told, and the run folder in the
    answer."""

    replay: bool = True
    tell: Tell = silent
    place: str = ""


@dataclass(frozen=True)
class Motions:
    """What is written beside the plan: the controller's table, the motion of the plant, and the
    arrays of a policy that plays it there."""

    table: Trajectory | None = None
    plant: Trajectory | None = None
    policy: Mapping[str, Array] | None = None


@dataclass(frozen=True)
class Trial:
    """A plan, its entries in the JSON with those of its executions, what is written, and how the
    executions were judged where there were any. `repair`: by what it comes of the trial before."""

    plan: Plan
    result: dict[str, Any]
    motions: Motions
    judged: Judged | None = None
    repair: str = ""

    def __str__(self) -> str:
        """One line: where it began, what was repaired, how good it is."""
        cost = f"cost {self.plan.objective:.4g}"
        parts = [self.plan.start, self.repair, str(self.result["status"]), cost]
        if self.misses:
            parts.append(f"misses {self.misses:.2g} of what is allowed")
        return ", ".join(part for part in parts if part)

    @property
    def good(self) -> bool:
        """Whether it is solved and its executions confirm it."""
        return bool(self.result["good"])

    @property
    def inputs_miss(self) -> bool:
        """Whether its inputs miss on its own model, and its elements have few stages."""
        done, stages = self.judged, self.plan.stages
        few = stages is not None and stages.stages < RADAU9.stages
        return few and done is not None and not done.verdicts["replay"].good

    @property
    def table_misses(self) -> bool:
        """Whether of its own model's executions only that of the table misses."""
        done = self.judged
        return done is not None and done.verdicts["replay"].good and not done.replays

    @property
    def leans_on_air(self) -> bool:
        """Whether only the simulated robot does not keep to it, which has physical chambers where
        the plan's model has first-order ones."""
        done, found = self.judged, self.plan
        if done is None or done.good or not done.replays or with_lags(found.model) is not None:
            return False
        return load_spec(found.task.plant).chambers == "orifice"

    @property
    def misses(self) -> float:
        """The largest error in units of what is allowed; 0 where the plan is good and its table
        well within that."""
        if self.judged is None:
            return 0.0
        if not self.good:
            return self.judged.share
        table = self.judged.verdicts["table_replay"].share
        return table if table > WELL else 0.0

    @property
    def fine(self) -> bool:
        """Whether nothing is left to be improved."""
        return self.good and self.misses == 0.0

    @property
    def score(self) -> tuple[bool, bool, bool, bool, float, float]:
        """Better ones are greater: good, a plan at all, one that fulfils its own equations, true on
        its own model; by what executions miss; by cost."""
        found, solved = self.plan, self.plan.status is Status.SOLVED
        replays = self.judged is not None and self.judged.replays
        return self.good, found.status.plan, solved, replays, -self.misses, -found.objective


def executed(
    found: Plan,
    execution: TrialOrder,
    table: Trajectory | None = None,
    share: Share | None = None,
    repair: str = "",
) -> Trial:
    """A plan with its table and, if asked for, its executions."""
    result = answer(found, execution.place)
    if table is None and found.attempts:
        table = controller_table(found.model, found.trajectory, found.task.hold)
    if table is None or not execution.replay or not found.status.plan:
        return Trial(found, result, Motions(table), repair=repair)
    wait_for_compiler(execution.tell)
    if share is None:
        execution.tell("replay: the times of controller.csv")
        table = retimed(found.model, found.trajectory, table)
    trial = Trial(found, result, Motions(table), repair=repair)
    try:
        done = judged(found, table, tell=execution.tell)
        trial = confirmed(replace(trial, judged=done), execution.place)
    except KembaError as error:  # a model that the simulator cannot execute still has its plan
        result |= _unconfirmed(found, f"it cannot be simulated: {error}")
        result["sentence"] = "; ".join([result["sentence"], *warnings(found)])
    if share is not None:
        trial.result["robust"] = share.summary()
        trial.result["sentence"] += f"; {share.sentence}"
    return trial


def confirmed(trial: Trial, place: str) -> Trial:
    """The trial with what its executions, as they were judged, say of it and leave to be written.
    `place`: the run folder."""
    found, done = trial.plan, trial.judged
    assert done is not None
    result = {**answer(found, place), **done.facts, **_confirmed(trial, done)}
    result["sentence"] = "; ".join([result["sentence"], *warnings(found)])
    feedback = done.feedback
    policy = feedback.arrays if feedback else None
    return replace(trial, result=result, motions=Motions(trial.motions.table, done.motion, policy))


def _confirmed(trial: Trial, done: Judged) -> dict[str, Any]:
    """What the executions of a plan change in the answer: it stays solved only if all of them come
    near enough."""
    found, task = trial.plan, trial.plan.task
    other, without = another_robot(task.model, task.plant), lacking(task.model, task.plant)
    names = [f"the plant is another robot, {other}, which {task.plant} names"] if other else []
    if without:
        names.append(f"the plant is without {enumerated(without)}, as the plan's model")
    if alike := carried_over(task.model, task.plant, task.payload):
        names.append(f"the plant has {enumerated(alike)}, too")
    if trial.leans_on_air:
        names.append(AIR)
    facts: dict[str, Any] = {"verdict_on": done.truth.on}
    facts |= {"band": done.band.json() if done.band else None}
    facts |= {"feedback": done.feedback.json} if done.feedback else {}
    if done.good:
        return {**facts, "sentence": "; ".join([sentence_of(found), *names, *done.remarks])}
    return facts | _unconfirmed(found, " and ".join(done.causes), [*names, *done.remarks])


def _unconfirmed(found: Plan, cause: str, remarks: Sequence[str] = ()) -> dict[str, Any]:
    """Status and sentence of a plan that its executions do not confirm: it is not solved, even
    where it fulfils its own equations."""
    if found.status is Status.SOLVED:
        what = found.sentence.removeprefix("solved: ")
        parts = [f"FAILED: a plan was found, but {cause}", *remarks, f"the plan: {what}"]
    else:
        parts = [sentence_of(found), cause, *remarks]
    return {"status": Status.ACCEPTABLE, "good": False, "sentence": "; ".join(parts)}
