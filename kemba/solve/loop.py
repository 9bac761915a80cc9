"""The plan that `solve` gives: starts, each planned, executed and repaired, until one is good.

for each start:                     an earlier plan, one guess after the other
    plan from it                    kemba.ocp.planning
    for each repair:                nothing, more stages an element, edges on ticks
        execute and judge           kemba.solve.trial
    stop if the best trial is good
    in turn with physical chambers, if only the simulated robot misses, which has them
give the trial of the best score; where the plant keeps to none, the best that it keeps to with
feedback                            kemba.solve.feedback
"""

import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from kemba.config import Document
from kemba.errors import KembaError
from kemba.model import load_spec
from kemba.ocp import Plan, Task
from kemba.ocp.certificate.status import Status
from kemba.ocp.continuation.origin import Origin
from kemba.ocp.finer import dear
from kemba.ocp.nlp.ipopt import Watch
from kemba.ocp.planned import answer
from kemba.ocp.planning import Planning, plan_best, spent
from kemba.plant.certificate import PLANT
from kemba.plant.repeat import PLAIN
from kemba.scenarios.share import Share
from kemba.solve.trial import Trial, TrialOrder, executed
from kemba.stopwatch import Tell, silent
from kemba.trajectory import Trajectory


@dataclass(frozen=True)
class Listener:
    """What is called at each stage and iteration, and what may ask to stop."""

    tell: Tell = silent
    watch: Watch | None = None
    stop: Callable[[], bool] | None = None


TICKS = "valve edges on the ticks of the controller"
STAGES = "five stages in every element"


def repaired(first: Trial, planning: Planning, execution: TrialOrder) -> Iterator[Trial]:
    """The trial; that with more stages an element where its inputs miss on the plan's own model,
    which errors of integration let a sensitive motion do; and that with valve edges on ticks where
    only its table misses there, or nearly does. A plan that was not refined, or whose time is over,
    is not repaired."""
    yield first
    if first.fine or planning.over or not first.judged or not first.plan.refined:
        return
    if first.inputs_miss:
        execution.tell(STAGES)
        finer = _again(first.plan, planning, "the same plan with fewer stages", finer=True)
        if finer is None:
            return
        first = executed(finer, execution, repair=STAGES)
        yield first
    if not first.fine and (first.good or first.table_misses):
        execution.tell(TICKS)
        name = "the same plan with edges between ticks"
        near = _again(first.plan, planning, name, ticks=True)
        if near is not None:
            yield executed(near, execution, repair=TICKS)


def _again(
    old: Plan, planning: Planning, name: str, ticks: bool = False, finer: bool = False
) -> Plan | None:
    """The plan with its valve edges on `ticks`, or with `finer` elements; None where that fails in
    one step, or where it costs so much more that another guess is likely to cost less."""
    name = "the earlier plan" if old.continued else name
    near, _ = planning.continued(old.origin(name, once=True, ticks=ticks, finer=finer))
    if near is None or near.status is not Status.SOLVED or dear(near, old.objective):
        return None
    return replace(near, continued=old.continued, start=old.start)


UNTRIED = "the time limit came before it was executed in any scenario"
SPENT = ("attempts", "iterations", "solve_s", "solve_cpu_s", "build_s")  # what all trials add to


@dataclass(frozen=True)
class Approach:
    """How a plan is sought.

    `start`: a trajectory to begin from. `starts`, `jobs`: how many start guesses, on how many
    cores. `origin`: an earlier plan to continue for the changed figures. Where none of these is
    given, the nearest plan of the user's own comes first, unless `cold`. `memory`: whether these
    are known at all. `replay`: execute the plan
    on the same model and on the plant, and compare both with the task's tolerances; a plan that
    misses them is `acceptable`, not `solved`. `log`: where IPOPT's text goes.
    """

    start: Trajectory | None = None
    starts: int = 1
    jobs: int | None = None
    replay: bool = True
    origin: Origin | None = None
    cold: bool = False
    memory: bool = False
    log: Path | None = None

    @property
    def free(self) -> bool:
        """Whether nothing is said about where to begin."""
        return self.start is None and self.origin is None and not self.cold


@dataclass(frozen=True)
class PlanCandidate:
    """A plan to execute, with its table and its share of successes where it was executed in
    scenarios."""

    plan: Plan
    table: Trajectory | None = None
    share: Share | None = None


def best_plan(
    task: Task, document: Document, approach: Approach, listener: Listener, place: str = ""
) -> Trial:
    """The plan of a task, executed and judged: the first good one, or the best of all tried.

    `place`: the run folder in the answer. All of it ends at the task's `solver.time_limit`. Raises
    KembaError where the task or a file is wrong.
    """
    deadline = time.monotonic() + task.solver.time_limit
    execution = TrialOrder(approach.replay, listener.tell, place)
    planning = _planning(task, document, approach, listener, deadline)
    tried: list[Trial] = []
    for current, one in _candidates(planning, tried, approach, listener, deadline):
        first = executed(one.plan, execution, one.table, one.share)
        trials = repaired(first, current, execution) if approach.replay else iter((first,))
        tried.extend(trials)
        best = max(tried, key=lambda trial: trial.score)
        if best.good:
            break
    last = tried[-1]
    if one.share is not None and best.plan is not one.plan:
        from kemba.solve.robust import with_share

        best = with_share(best)
    elif one.share is None and not best.good:
        from kemba.solve.feedback import first_with_feedback  # loads SciPy's linear algebra

        best = first_with_feedback(tried, execution, deadline) or best
    if approach.memory:
        from kemba.solve.memory import best_known

        model = planning.planner.model
        best.result["best_known"] = best_known(planning.planner.task, model, listener.tell)
    best = best if best is last else _with_all(best, last)
    if (air := best.plan.task.model) != task.model:
        best.result["sentence"] += f"; {WITH_AIR.format(load_spec(air).name)}"
    best.result["trials"] = [str(trial) for trial in tried]
    return best


def _with_all(best: Trial, last: Trial) -> Trial:
    """The best trial, with the solves and times of all."""
    plan = spent(best.plan, last.plan)
    whole = answer(plan, "")
    result = {**best.result, **{name: whole[name] for name in SPENT}}
    return replace(best, plan=plan, result=result)


def _planning(
    task: Task, document: Document, approach: Approach, listener: Listener, deadline: float
) -> Planning:
    told: dict[str, Any] = {"log": approach.log, "tell": listener.tell, "deadline": deadline}
    told |= {"watch": listener.watch, "stop": listener.stop}
    return Planning.of(task, document, start=approach.start, **told)


def _candidates(
    planning: Planning,
    tried: Sequence[Trial],
    approach: Approach,
    listener: Listener,
    deadline: float,
) -> Iterator[tuple[Planning, PlanCandidate]]:
    """Plans of a task with the planning that made them, when asked for; `tried`: those executed."""
    task, document = planning.planner.task, planning.document
    origin = approach.origin
    if approach.replay and task.robust > 0:
        yield planning, _most_robust(task, document, approach, listener, deadline)
        return
    if approach.starts > 1:
        told = approach.log, listener.tell, deadline
        best = plan_best(task, document, approach.starts, approach.jobs, *told)
        yield planning, PlanCandidate(best)
        return
    if approach.free and approach.memory:
        from kemba.solve.memory import recalled

        origin = recalled(task, planning.planner.model, listener.tell)
    physical: Planning | None = None
    turns = deque([(planning, planning.plans(origin))])
    while turns:
        current, plans = turns.popleft()
        found = next(plans, None)
        if found is None:
            continue
        turns.append((current, plans))
        yield current, PlanCandidate(found)
        leans = physical is None and not planning.over and tried[-1].leans_on_air
        if leans and (physical := in_physical_air(planning)):
            listener.tell("with the air of the simulated robot")
            enough = deadline - time.monotonic() > planning.clock.wall
            turns.appendleft((physical, in_turn(physical, tried[-1].plan, guesses_first=enough)))


def in_turn(planning: Planning, old: Plan, guesses_first: bool) -> Iterator[Plan]:
    """Plans from guesses, which may be much cheaper, and the one from the `old` plan of another
    model, which is sooner found."""

    def near() -> Iterator[Plan]:
        found, _ = planning.continued(old.origin("the plan with other air"))
        if found is not None:
            yield replace(found, continued=None, start=old.start)

    ways = [planning.plans(), near()]
    for way in ways if guesses_first else reversed(ways):
        if not planning.over:
            yield from way


WITH_AIR = "planned with `model: {}`, since the simulated robot missed the plan without its air"
ITS_AIR = "orifice"  # the shipped model with the air of the shipped simulated robot


def in_physical_air(planning: Planning) -> Planning | None:
    """The planning of the same task with the air of the shipped simulated robot; None where another
    one executes, or the task changes what that air does not have."""
    task, document, session = planning.planner.task, planning.document, planning.planner.session
    if task.plant != PLANT:
        return None
    name = ITS_AIR if task.model == PLAIN else f"{task.model}+{ITS_AIR}"
    own = task.model_copy(update={"model": name})
    try:
        new = Planning.of(own, document, deadline=session.control.deadline)
    except KembaError:  # the task changes an effect of the air that it had
        return None
    return replace(new, planner=replace(new.planner, session=session), clock=planning.clock)


def _most_robust(
    task: Task, document: Document, approach: Approach, listener: Listener, deadline: float
) -> PlanCandidate:
    """The plan that succeeds in most of the task's scenarios."""
    from kemba.solve.robust import most_robust  # loads SciPy, which most plans do not need

    def solve(task: Task) -> Plan:
        planning = _planning(task, document, approach, listener, deadline)
        return next(planning.plans(approach.origin))

    def changed(found: Plan, task: Task) -> Plan | None:
        hint = "other starts (--starts 4) may take less"
        origin = found.origin("the plan as asked", dear=hint, once=True)
        return _planning(task, document, approach, listener, deadline).continued(origin)[0]

    found = most_robust(task, solve, changed, listener.tell, deadline)
    plan = found.plan
    if plan.status.plan and found.share is None:
        plan = replace(plan, sentence=f"{plan.sentence}; {UNTRIED}")
    return PlanCandidate(plan, found.table, found.share)
