"""A plan beside the best that is known: the shipped plans of nearly the same task."""

from __future__ import annotations

from typing import Any

from kemba.ocp.certificate.objective import objective
from kemba.ocp.certificate.status import Status
from kemba.ocp.planned import Plan
from kemba.ocp.reading import task_model
from kemba.ocp.shipped.shelf import Near, neighbours
from kemba.ocp.task.task import Task


def compared(found: Plan, task: Task) -> tuple[dict[str, Any] | None, str]:
    """The entry `best_known` of the JSON, and a remark where the plan costs much more than it.

    `cost`, in the task's own weights, is that of the nearest shipped plan, the best `of` so many
    of its figures; `away` is how far these are. None where no shipped plan is near. `task`: as
    asked, without air that was fitted for the plan.
    """
    near = neighbours(task, task_model(task))
    if not near or found.status not in (Status.SOLVED, Status.ACCEPTABLE):
        return None, ""
    entry, dear = near[0].entry, Near.current().dear
    known = {"cost": entry.cost, "of": entry.of, "plan": entry.name, "away": near[0].away}
    own = objective(found.model, found.task, found.requirements, found.trajectory)
    usual = max(n.entry.cost for n in near[:2])  # costs rise and fall between neighbours
    if own <= dear * usual:
        return known, ""
    times = f"{own / usual:.1f} times what shipped plans nearby cost"
    return known, f"; it costs {times}, other starts may cost less (--starts 4)"
