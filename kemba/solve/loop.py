"""The plan that `solve` gives: starts, each planned, executed and repaired, until one is good.

for each start:                     an earlier plan, shipped plans nearby, a guess
    plan from it                    kemba.ocp
    for each repair:                nothing, edges on ticks, another guess
        execute and judge           kemba.solve.trial
    stop if the best trial is good
give the trial of the best score
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from kemba.config import Document
from kemba.ocp import Plan, Task, plan
from kemba.ocp.continuation.between import Origin
from kemba.ocp.continued import dear, from_scratch
from kemba.ocp.known import compared
from kemba.ocp.planning import plan_from, plans_nearby
from kemba.ocp.reading import task_model
from kemba.ocp.shipped.kind import figures_of
from kemba.ocp.shipped.shelf import Near, neighbours
from kemba.ocp.starts import plan_best
from kemba.solve.listener import Listener
from kemba.solve.repairs import repaired, summed
from kemba.solve.trial import Begun, Trial, TrialOrder, executed
from kemba.trajectory import Trajectory

if TYPE_CHECKING:
    from kemba.scenarios.share import Share


@dataclass(frozen=True)
class Approach:
    """How a plan is sought.

    `start`: a trajectory to begin from. `starts`, `jobs`: how many start guesses, on how many
    cores. `origin`: an earlier plan to continue for the changed figures. Where none of these is
    given, shipped plans that are near come first, unless `cold`. `replay`: execute the plan on the
    same model and on the plant, and compare both with the task's tolerances; a plan that misses
    them is `acceptable`, not `solved`. `log`: where IPOPT's text goes.
    """

    start: Trajectory | None = None
    starts: int = 1
    jobs: int | None = None
    replay: bool = True
    origin: Origin | None = None
    cold: bool = False
    log: Path | None = None

    @property
    def free(self) -> bool:
        """Whether nothing is said about where to begin."""
        return self.start is None and self.origin is None


@dataclass(frozen=True)
class PlanCandidate:
    """A plan to execute, with its table and its share of successes where it was executed in
    scenarios. `last`: it may be made again from a guess."""

    plan: Plan
    table: Trajectory | None = None
    share: Share | None = None
    last: bool = False


def best_plan(
    task: Task,
    document: Document,
    approach: Approach,
    listener: Listener,
    begun: Begun | None = None,
    place: str = "",
) -> Trial:
    """The plan of a task, executed and judged: the first good one, or the best of all tried.

    `begun` gets each plan before it is executed, at last the one that is returned. `place`: the
    run folder in the answer. Raises KembaError where the task or a file is wrong.
    """
    begun = begun or (lambda plan: None)
    execution = TrialOrder(approach.replay, listener.tell, begun, place)
    best = last = None
    for one in _candidates(task, document, approach, listener):
        first = executed(one.plan, execution, one.table, one.share)
        if not approach.replay or (first.good and one.share):
            trials = iter((first,))
        else:
            how = {**_how(listener), "log": approach.log}
            trials = repaired(first, one.plan.task, document, how, execution, one.last)
        made: Trial | None = None
        for last in trials:
            made = last if made is None or last.score[:4] > made.score[:4] else made
        assert made is not None
        if one.share is not None and made.plan is not one.plan:
            from kemba.solve.robust import with_share

            made = with_share(made)
        best = made if best is None else max(best, made, key=lambda trial: trial.score)
        if best.good and approach.starts == 1:
            break
    assert best is not None
    if best is not last and best.motions.table is not None:
        begun(best.plan.trajectory)
    known, remark = compared(best.plan, task)
    if best.plan.continued is False and best.plan.start.startswith("shipped"):
        remark += (
            "; it begins from a shipped plan: the earlier one is further, or does not come true"
        )
    best.result.update(best_known=known, sentence=best.result["sentence"] + remark)
    return best


def _how(listener: Listener) -> dict[str, Any]:
    return {"watch": listener.watch, "stop": listener.stop, "tell": listener.tell}


def shelf_is_nearer(figures: Mapping[str, float], task: Task) -> bool:
    """Whether a shipped plan has figures nearer to those of a task than `figures` are."""
    model, near = task_model(task), Near.current()
    own = np.linalg.norm(near.differences(figures_of(task, model), figures))
    return any(n.apart < own for n in neighbours(task, model))


def _tried_first(origin: Origin, task: Task) -> bool:
    """Whether an earlier plan is tried in one step, before shipped plans that are near the task:
    where none of them is nearer."""
    return bool(neighbours(task, task_model(task))) and not shelf_is_nearer(origin.figures, task)


def _candidates(
    task: Task, document: Document, approach: Approach, listener: Listener
) -> Iterator[PlanCandidate]:
    """Plans of a task, made when asked for: from the earlier plan, from shipped plans, from
    a guess or from the earlier plan in many steps; last are those that cost so much more than the
    shipped plans they begin from that a guess is likely to cost less."""
    how = _how(listener)

    def plans(task: Task) -> Iterator[PlanCandidate]:
        origin = approach.origin
        shelved = approach.start is None and not approach.cold
        if origin is not None and shelved and _tried_first(origin, task):
            once = replace(origin, once=True)
            near, _ = plan_from(once, task, document, approach.log, **how)
            if near is not None:
                yield PlanCandidate(near)
                origin = None
        late = []
        for one, entry in plans_nearby(task, document, approach.log, **how) if shelved else ():
            candidate = PlanCandidate(one if approach.free else replace(one, continued=False))
            if dear(one, entry.cost):
                late.append(candidate)
            else:
                yield candidate
        yield PlanCandidate(solved(task, origin), last=True)
        yield from late

    def solved(task: Task, origin: Origin | None) -> Plan:
        a = approach
        if a.starts > 1 and a.free:
            return plan_best(task, document, a.starts, a.jobs, a.log, listener.tell)
        found = plan(task, document, log=a.log, start=a.start, origin=origin, **how)
        left = a.origin is not None and origin is None
        return from_scratch(found, "the simulated robot does not follow it") if left else found

    if approach.replay and task.robust > 0:
        from kemba.solve.robust import most_robust  # loads SciPy, which most plans do not need

        def changed(found: Plan, task: Task) -> Plan | None:
            if shelf_is_nearer(figures_of(found.task, found.model), task):
                for one, _ in plans_nearby(task, document, approach.log, **how):
                    return replace(summed(found, one), start=one.start)
            names = "the plan as asked", "other starts (--starts 4) may take less"
            known = found.trajectory, found.model, found.requirements
            origin = Origin(*known, *names, once=True, stages=found.stages)
            new, _ = plan_from(origin, task, document, approach.log, **how)
            return new and summed(found, new)

        found = most_robust(task, lambda task: next(plans(task)).plan, changed, listener.tell)
        yield PlanCandidate(found.plan, found.table, found.share, last=True)
        return
    yield from plans(task)
