"""A plan that the plant executes as planned: with fitted air, and valve edges on ticks.

Eq. 4 to 7 with Tables I and II differ from eq. 1 to 3 by a few percent of force. That changes the
take-off by 0.1 m/s, and the touchdown by 20 ms. No table of commands can make up for it, but a plan
can be made with figures that hold along its own motion.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from kemba.config import Document
from kemba.errors import KembaError
from kemba.ocp import Plan, Task
from kemba.ocp.continuation.between import Origin
from kemba.ocp.planning import plan, plan_from
from kemba.ocp.reading import task_model
from kemba.plant.execution.fitted_air import FittedAir, fitted_air
from kemba.report.judging.executed import Begun, Executed, executed
from kemba.report.listener import Listener
from kemba.settings import Settings, setting


class RefitRounds(Settings):
    """How often a plan is made again: with fitted air, on ticks, or from a guess."""

    rounds: int = setting(
        6, "1", "plans at most; most jumps that missed were good after one or two", "tuned: by hand"
    )


def matched(
    first: Executed,
    task: Task,
    document: Document,
    listener: Listener,
    begun: Begun,
    log: Path | None = None,
    place: str = "",
) -> Iterator[Executed]:
    """Plans of a task that come true better, each executed, until one is good.

    Where only the table misses on the plan's own model, valve edges are put on its ticks. Where
    the plant misses, the air is fitted; not where the task says `fit_air: false`, or its model has
    no first-order chambers. Where a plan with fitted air does not come true on its own model, or no
    other air fits better, it is made anew from a guess, once. Nothing where the first plan fails by
    itself.
    """
    tell = listener.tell
    how: dict[str, Any] = {"log": log, "tell": tell}
    how |= {"watch": listener.watch, "stop": listener.stop}
    now, fit, ticks, anew = first, None, False, False
    tried: list[TriedAir] = []
    for _ in range(RefitRounds.current().rounds):
        if now.good:
            return
        near = True
        if not ticks and _table_misses(now):
            ticks = True
            tell("valve edges on the ticks of the controller")
        elif other := _other_air(now, task, fit, tried):
            fit = other
            tell("the air of the plan's model, fitted to the simulated robot")
        elif fit is not None and not anew:
            anew, near = True, False
            tell("a plan from a guess, with this air")
        else:
            return
        asked = _with_air(task, fit)
        new = _continued(now.plan, asked, document, ticks, fit is None, how) if near else None
        if new is None and fit is not None:
            new = plan(asked, document, **how)
        if new is None or not new.status.plan:
            return
        new = summed(now.plan, new)
        now = executed(new, None, None, True, tell, begun, place)
        if fit is not None:
            now.result["fitted_air"] = fit.summary()
            now.result["sentence"] += f"; {fit.sentence}"
        yield now


@dataclass(frozen=True)
class TriedAir:
    """A fit, None for the tables, and how late [s] the plant touched down with its plan."""

    fit: FittedAir | None
    late: float


def _replays(now: Executed) -> bool:
    """Whether the plan's own inputs come true on its model."""
    return now.judged is not None and now.judged.verdicts["replay"].good


def _table_misses(now: Executed) -> bool:
    """Whether of its own model's executions only that of the table misses."""
    return _replays(now) and now.judged is not None and not now.judged.replays


def _other_air(
    now: Executed, task: Task, fit: FittedAir | None, tried: list[TriedAir]
) -> FittedAir | None:
    """Air that fits better, None where there is none; what the plan has is noted in `tried`."""
    if not _replays(now):
        return None
    tried.append(TriedAir(fit, _late(now)))
    new = between(tried) or _fitted(now, task, fit)
    return None if new is None or (fit is not None and new.factors == fit.factors) else new


def _late(now: Executed) -> float:
    there = now.judged.facts["plant_replay"] if now.judged else None
    return float((there or {}).get("touchdown_error_s") or 0.0)


def between(tried: Sequence[TriedAir]) -> FittedAir | None:
    """Air between the last two figures that were tried, by the secant of their touchdowns; None
    where these are not on both sides of the plan's.

    A fit is made for one motion, and the next plan is another. Of a jump whose feet rise by a
    centimetre, one plan can land 70 ms late and the next one 20 ms early.
    """
    if len(tried) < 2 or tried[-2].late * tried[-1].late >= 0.0:
        return None
    old, new = tried[-2:]
    assert new.fit is not None
    return new.fit.towards(old.fit, new.late / (new.late - old.late))


def _fitted(now: Executed, task: Task, earlier: FittedAir | None) -> FittedAir | None:
    """The air of the task's model fitted to the plant's motion; None where nothing can be
    fitted."""
    done, table = now.judged, now.motions.table
    if not task.fit_air or done is None or done.motion is None or table is None:
        return None
    try:
        return fitted_air(task_model(task), table, done.motion, earlier)
    except KembaError:
        return None


def _origin_of(old: Plan) -> str:
    """What the sentence calls the plan from which the first one began."""
    if old.continued:
        return "the earlier plan"
    kind, _, name = old.start.partition(": ")
    return f"the shipped plan {name}" if kind == "shipped" else "the plan before"


def _with_air(task: Task, fit: FittedAir | None) -> Task:
    """The task with fitted air among its effects."""
    changes = {name: dict(values) for name, values in task.effects.items()}
    for name, values in (fit.changes(task_model(task)) if fit else {}).items():
        changes[name] = {**changes.get(name, {}), **values}
    return task.model_copy(update={"effects": changes})


def _continued(
    old: Plan, asked: Task, document: Document, ticks: bool, once: bool, how: dict[str, Any]
) -> Plan | None:
    """A plan continued for a task, with valve edges on ticks if `ticks`; None where that fails."""
    known = old.trajectory, old.model, old.requirements
    names = _origin_of(old), "other starts (--starts 4) may take less"
    origin = Origin(*known, *names, once=once, ticks=ticks, stages=old.stages)
    return plan_from(origin, asked, document, **how)[0]


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
