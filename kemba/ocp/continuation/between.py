"""Problems between that of an earlier plan and the one that is asked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isfinite
from typing import Any

import numpy as np

from kemba.effects import Effect
from kemba.model import Model
from kemba.ocp.phases.stages import Stages
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.transcription.solution import groups
from kemba.trajectory import Trajectory


@dataclass(frozen=True)
class Origin:
    """An earlier plan, the model it was made with, and what was asked of it.

    `name`: what sentences call it; `dear`: what to do where the new plan costs much more. `once`:
    where the whole change fails in one step, also from the earlier plan solved on its new
    intervals, nothing else is tried. `ticks`: valve edges of the new plan are on the controller's
    ticks; where that fails at once, these ticks do not fit, and nothing else is tried. `stages`:
    the solved program of the plan, where it is at hand. `run`: its folder; `given`: whether the
    user named it.
    """

    plan: Trajectory
    model: Model
    requirements: tuple[Requirement, ...]
    name: str = "the earlier plan"
    dear: str = "one without --from may take less"
    once: bool = False
    ticks: bool = False
    stages: Stages | None = None
    run: str = ""
    given: bool = True


def model_between(old: Model, new: Model, share: float) -> Model:
    """The new model with its numbers at `share` of the way from the old ones.

    An effect that only the new model has grows from the value at which it is absent. Tables of
    another size, and effects that only the old model has, change at once.
    """
    if share >= 1.0:
        return new
    before = {effect.name: effect for effect in old.effects}
    effects = [_effect_between(before.get(e.name), e, share) for e in new.effects]
    supply = old.supply + share * (new.supply - old.supply)
    return Model(new.mechanism, effects, supply, new.name)


def _effect_between(old: Effect | None, new: Effect, share: float) -> Effect:
    if old is None:
        start = {name: float(value) for name, value in new.off.items()}
    else:
        tables = [name for name, value in old if isinstance(value, tuple)]
        start = {name: old.value(name) for name in (*old.parameters(), *tables)}
    between = {name: _figure(first, new.value(name), share) for name, first in start.items()}
    changed = {name: value for name, value in between.items() if value is not None}
    return new.bind(changed) if changed else new


def _figure(first: Any, last: Any, share: float) -> Any:
    """A number or table on the way; None where it does not change or changes at once."""
    if first == last:
        return None
    if isinstance(first, float | int) and isinstance(last, float | int):
        return _between(first, last, share)
    if isinstance(first, tuple) and isinstance(last, tuple) and len(first) == len(last):
        return tuple(_between(a, b, share) for a, b in zip(first, last, strict=True))
    return None


def requirements_between(
    old: Sequence[Requirement], new: Sequence[Requirement], share: float
) -> list[Requirement]:
    """The new requirements with finite bounds, and the times at which they hold, at `share` of
    the way from the old ones."""
    before = {(r.location, r.quantity.name, r.at): r for r in old}
    found = []
    for asked in new:
        was = before.get((asked.location, asked.quantity.name, asked.at))
        if was is not None and share < 1.0:
            lower = _between(was.lower, asked.lower, share)
            upper = _between(was.upper, asked.upper, share)
            begin, end = (
                _between(*ends, share) for ends in zip(was.during, asked.during, strict=True)
            )
            asked = replace(asked, lower=lower, upper=upper, during=(begin, end))
        found.append(asked)
    return found


def _between(old: float, new: float, share: float) -> float:
    return old + share * (new - old) if isfinite(old) and isfinite(new) else new


def completed(plan: Trajectory, model: Model) -> Trajectory:
    """The plan with every column that `model` names: new states at rest, new forces and inputs
    zero."""
    listed = groups(model)
    absent = {
        q.header: np.full(len(plan), float(q.value) if name == "s" else 0.0)
        for name in ("s", "u", "lam")
        for q in listed[name]
        if q.name not in plan
    }
    return plan.with_columns(absent) if absent else plan
