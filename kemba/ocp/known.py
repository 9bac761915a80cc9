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
    """A remark where the cheapest shipped plan of the same figures, but with more time, costs much
    less than `own`; "" where none does."""
    longer = [n.entry for n in near if _has_more_time(n.entry.figures, asked)]
    best = min(longer, key=lambda entry: entry.cost, default=None)
    if best is None or Near.current().dear * best.cost >= own:
        return ""
    time = f"{best.figures['duration']:g} s"
    told = f"a shipped plan costs {best.cost:.3g} instead of {own:.3g}"
    return f'; with more time, --set "duration={time}", {told}'


def _has_more_time(figures: Mapping[str, float], asked: Mapping[str, float]) -> bool:
    """Whether a plan differs from what is asked by a longer duration alone."""
    rest = asked.keys() - {"duration"}
    same = all(math.isclose(figures[name], asked[name]) for name in rest)
    return same and figures["duration"] > asked["duration"]
