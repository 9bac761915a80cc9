"""What is changed in a plan whose executions miss: one thing after the other, each executed.

1. Where only the table misses on the plan's own model, or nearly does, valve edges are put on the
   controller's ticks.
2. Where that is not enough, the plan is made from another guess, and its edges put on ticks.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from kemba.config import Document
from kemba.ocp import Plan, Task
from kemba.ocp.certificate.objective import objective
from kemba.ocp.certificate.status import Status
from kemba.ocp.continuation.between import Origin
from kemba.ocp.continued import dear
from kemba.ocp.phases.settings import Refining
from kemba.ocp.planning import plan, plan_from
from kemba.solve.trial import Trial, TrialOrder, executed

GUESSES = 2  # other guesses at most; each costs as much as the first plan
TICKS, ANOTHER = "valve edges on the ticks of the controller", "another plan, from a guess"


def repaired(
    first: Trial,
    task: Task,
    document: Document,
    how: Mapping[str, Any],
    execution: TrialOrder,
    guess: bool,
) -> Iterator[Trial]:
    """The trial and those that come of repairing it, until one is `fine` or nothing is left to try.

    `how`: the arguments of `plan` on who is told and who may stop it. `guess`: whether plans may be
    made from other guesses. A plan that was not refined is not repaired.
    """
    now = first
    for number in range(1 + GUESSES * guess):
        if number:
            execution.tell(ANOTHER)
            found = _from_guess(task, document, number, how)
            if found.status is Status.INTERRUPTED:
                return
            if not found.status.plan:
                continue
            both = summed(now.plan, found)
            made = replace(both, start="guess", continued=None if both.continued is None else False)
            now = executed(made, execution, repair=ANOTHER)
        yield now
        if now.fine or not now.judged or not now.plan.refined:
            return
        if now.good or now.table_misses:
            execution.tell(TICKS)
            near = _on_ticks(now.plan, document, how)
            if near is not None:
                before, now = now, executed(summed(now.plan, near), execution, repair=TICKS)
                yield now
                if before.good:
                    return
        if now.good:
            return


def _from_guess(task: Task, document: Document, number: int, how: Mapping[str, Any]) -> Plan:
    noise = max(task.guess_noise, Refining.current().second_start)
    other = task.model_copy(update={"guess_noise": noise, "seed": task.seed + number})
    return replace(plan(other, document, **how), task=task)


def _on_ticks(old: Plan, document: Document, how: Mapping[str, Any]) -> Plan | None:
    """The plan with its valve edges on ticks; None where that fails in one step, or where it costs
    so much more that another guess is likely to cost less."""
    known = old.trajectory, old.model, old.requirements
    names = _origin_of(old), "other starts (--starts 4) may take less"
    origin = Origin(*known, *names, once=True, ticks=True, stages=old.stages)
    near, _ = plan_from(origin, old.task, document, **how)
    if near is None or near.status is not Status.SOLVED:
        return None
    before = objective(old.model, old.task, old.requirements, old.trajectory)
    return None if dear(near, before) else near


def _origin_of(old: Plan) -> str:
    """What the sentence calls the plan from which the first one began."""
    if old.continued:
        return "the earlier plan"
    kind, _, name = old.start.partition(": ")
    return f"the shipped plan {name}" if kind == "shipped" else "the plan before"


def summed(old: Plan, new: Plan) -> Plan:
    """The new plan with the solves and the times of both."""
    return replace(
        new,
        attempts=old.attempts + new.attempts,
        solve_s=old.solve_s + new.solve_s,
        solve_cpu_s=old.solve_cpu_s + new.solve_cpu_s,
        build_s=old.build_s + new.build_s,
        continued=old.continued,
        start=old.start,
    )
