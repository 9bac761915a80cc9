"""A plan that the plant executes as planned: the first one, changed until it comes true.

Eq. 4 to 7 with Tables I and II differ from eq. 1 to 3 by a few percent of force. That changes the
take-off by 0.1 m/s, and the touchdown by 20 ms. No table of commands can make up for it, but a plan
can be made with figures that hold along its own motion.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from kemba.config import Document
from kemba.ocp import Plan, Task
from kemba.ocp.certificate.objective import objective
from kemba.ocp.certificate.status import Status
from kemba.ocp.continuation.between import Origin
from kemba.ocp.continued import dear
from kemba.ocp.planning import plan, plan_from
from kemba.plant.execution.fitted_air import FittedAir
from kemba.report.judging.executed import Begun, Executed, executed
from kemba.report.judging.remedies import Remedies, comes_true
from kemba.report.listener import Listener
from kemba.settings import Settings, setting


class RefitRounds(Settings):
    """How often a plan is made again: with fitted air, on ticks, or from a guess."""

    rounds: int = setting(
        8, "1", "plans at most; most jumps that missed were good after one or two", "tuned: by hand"
    )


def matched(
    first: Executed,
    task: Task,
    document: Document,
    listener: Listener,
    begun: Begun,
    log: Path | None = None,
    place: str = "",
    guess: bool = True,
) -> Iterator[Executed]:
    """Plans of a task that come true better, each executed, until one is `fine` or nothing is left
    to try (`Remedies`), without `guess` only continued ones. None where the first plan is not
    refined."""
    tell = listener.tell
    how: dict[str, Any] = {"log": log, "tell": tell}
    how |= {"watch": listener.watch, "stop": listener.stop}
    kept = first.plan.fitted_air
    now, remedies = first, Remedies(task, FittedAir(**kept) if kept else None, guess)
    for _ in range(RefitRounds.current().rounds):
        if now.fine or not (remedy := remedies.next(now)):
            return
        tell(remedy)
        asked, fit = remedies.asked, remedies.fit
        near = None if remedies.from_guess else _continued(now.plan, asked, document, remedies, how)
        if near is None and not remedies.needed:
            remedies.give_up()
            continue
        if near is None:
            remedies.guess_made()
        new = near or plan(asked, document, **how)
        if new.status is Status.INTERRUPTED:
            return
        if not new.status.plan:
            continue
        before, now = now, executed(summed(now.plan, new), None, None, True, tell, begun, place)
        if fit is not None:
            now.result["fitted_air"] = fit.summary()
        now.result["sentence"] += remedies.remark
        yield now
        if before.good:
            return  # its table is as near as can be
        if fit is None and not comes_true(now):
            remedies.give_up()
            now = first


def _origin_of(old: Plan) -> str:
    """What the sentence calls the plan from which the first one began."""
    if old.continued:
        return "the earlier plan"
    kind, _, name = old.start.partition(": ")
    return f"the shipped plan {name}" if kind == "shipped" else "the plan before"


def _continued(
    old: Plan, asked: Task, document: Document, remedies: Remedies, how: dict[str, Any]
) -> Plan | None:
    """A plan continued for a task as the remedies ask; None where that fails in one step, or where
    it costs so much more that one from a guess is likely to cost less."""
    known = old.trajectory, old.model, old.requirements
    names = _origin_of(old), "other starts (--starts 4) may take less"
    origin = Origin(*known, *names, once=True, ticks=remedies.ticks, stages=old.stages)
    near, _ = plan_from(origin, asked, document, **how)
    before = objective(old.model, asked, old.requirements, old.trajectory)
    return None if near is not None and dear(near, before) else near


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
