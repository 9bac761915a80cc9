"""What is changed in a plan whose table misses: valve edges are put on the controller's ticks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from kemba.ocp import Plan
from kemba.ocp.certificate.objective import objective
from kemba.ocp.certificate.status import Status
from kemba.ocp.continuation.origin import Origin
from kemba.ocp.continued import dear
from kemba.ocp.planning import Planning
from kemba.solve.trial import Trial, TrialOrder, executed

TICKS = "valve edges on the ticks of the controller"


def repaired(first: Trial, planning: Planning, execution: TrialOrder) -> Iterator[Trial]:
    """The trial, and that with valve edges on ticks where only its table misses, or nearly does, on
    the plan's own model. A plan that was not refined, or whose time is over, is not repaired."""
    yield first
    if first.fine or planning.over or not first.judged or not first.plan.refined:
        return
    if first.good or first.table_misses:
        execution.tell(TICKS)
        near = _on_ticks(first.plan, planning)
        if near is not None:
            yield executed(near, execution, repair=TICKS)


def _on_ticks(old: Plan, planning: Planning) -> Plan | None:
    """The plan with its valve edges on ticks; None where that fails in one step, or where it costs
    so much more that another guess is likely to cost less."""
    known = old.trajectory, old.model, old.requirements
    name = "the earlier plan" if old.continued else "the same plan with edges between ticks"
    origin = Origin(*known, name, once=True, ticks=True, stages=old.stages)
    near, _ = planning.continued(origin)
    if near is None or near.status is not Status.SOLVED:
        return None
    before = objective(old.model, old.task, old.requirements, old.trajectory)
    return None if dear(near, before) else replace(near, continued=old.continued, start=old.start)
