"""A plan beside the best that is known: the shipped plans of nearly the same task."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from kemba.ocp.certificate.objective import objective
from kemba.ocp.certificate.status import Status
from kemba.ocp.planned import Plan
from kemba.ocp.reading import task_model
from kemba.ocp.shipped.kind import figures_of
from kemba.ocp.shipped.shelf import Near, Neighbour, neighbours
from kemba.ocp.task.task import Task


def compared(found: Plan, task: Task) -> tuple[dict[str, Any] | None, str]:
    """The entry `best_known` of the JSON, and a remark where the plan costs much more than it, or
    than one with more time.

    `cost`, in the task's own weights, is that of the nearest shipped plan, the best `of` so many
    of its figures; `away` is how far these are. None where no shipped plan is near. `task`: as
    asked, without air that was fitted for the plan.
    """
    model = task_model(task)
    near = neighbours(task, model)
    if not near or found.status not in (Status.SOLVED, Status.ACCEPTABLE):
        return None, ""
    entry, dear = near[0].entry, Near.current().dear
    known = {"cost": entry.cost, "of": entry.of, "plan": entry.name, "away": near[0].away}
    own = objective(found.model, found.task, found.requirements, found.trajectory)
    usual = max(n.entry.cost for n in near[:2])  # costs rise and fall between neighbours
    if own <= dear * usual:
        return known, _with_more_time(near, figures_of(task, model), own)
    times = f"{own / usual:.1f} times what shipped plans nearby cost"
    return known, f"; it costs {times}, other starts may cost less (--starts 4)"


def _with_more_time(near: Sequence[Neighbour], asked: Mapping[str, float], own: float) -> str:
    """A remark where a shipped plan of the same figures, but with more time, costs much less than
    `own`; "" where none does."""
    rest = asked.keys() - {"duration"}
    for entry in (n.entry for n in near):
        same = all(math.isclose(entry.figures[name], asked[name]) for name in rest)
        longer = entry.figures["duration"] > asked["duration"]
        if same and longer and Near.current().dear * entry.cost < own:
            time = f"{entry.figures['duration']:g} s"
            told = f"a shipped plan costs {entry.cost:.3g} instead of {own:.3g}"
            return f'; with more time, --set "duration={time}", {told}'
    return ""
