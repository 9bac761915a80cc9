"""Earlier plans as origins: their solved programs in a file, problems on the way to another."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from kemba.effects import Effect
from kemba.files import atomic_path
from kemba.model import Model
from kemba.ocp.phases.modes import Phase
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


PREFIX = "solved_"  # of the arrays, beside others in the same file


def write_stages(file: Path, stages: Stages) -> None:
    """Write `stages.npz` of a run folder. Raises KembaError where it cannot be written."""
    with atomic_path(file) as path, path.open("wb") as stream:
        np.savez(stream, **_packed(stages))


def read_stages(file: Path) -> Stages | None:
    """What the file holds; None where there is none or it cannot be read: a plan is then begun from
    its nodes."""
    try:
        with file.open("rb") as stream:
            stages = _unpacked(np.load(stream, allow_pickle=False))
    except (OSError, KeyError, IndexError, ValueError, TypeError, EOFError, zipfile.BadZipFile):
        return None
    numbers = stages.values, stages.of_bounds, *stages.of_rows.values()
    return stages if stages.phases and all(np.isfinite(a).all() for a in numbers) else None


def _packed(stages: Stages) -> dict[str, Any]:
    """The arrays of a solved program by name."""
    phases, rows = stages.phases, stages.of_rows
    table = np.concatenate([np.zeros((0, 2)), *rows.values()])
    arrays = {
        "borders": np.array([(p.first, p.last) for p in phases]),
        "modes": np.array([p.modes for p in phases]),
        "valves": np.array([p.valves for p in phases]),
        "stages": np.array(stages.stages),
        "values": stages.values,
        "of_bounds": stages.of_bounds,
        "labels": np.array(list(rows)),
        "rows": np.array([len(own) for own in rows.values()], dtype=int),  # of each label
        "nodes": table[:, 0].astype(np.int32),
        "of_rows": table[:, 1],
    }
    return {f"{PREFIX}{name}": array for name, array in arrays.items()}


def _unpacked(kept: Mapping[str, Any]) -> Stages:
    borders, modes, valves = (kept[f"{PREFIX}{name}"] for name in ("borders", "modes", "valves"))
    phases = tuple(
        Phase(int(first), int(last), tuple(own.tolist()), tuple(there.tolist()))
        for (first, last), own, there in zip(borders, modes, valves, strict=True)
    )
    values, of_bounds = (kept[f"{PREFIX}{name}"].astype(float) for name in ("values", "of_bounds"))
    table = np.column_stack([kept[f"{PREFIX}nodes"], kept[f"{PREFIX}of_rows"].astype(float)])
    ends = np.cumsum(kept[f"{PREFIX}rows"])
    labels = (str(label) for label in kept[f"{PREFIX}labels"])
    of_rows = dict(zip(labels, np.split(table, ends[:-1]), strict=True)) if len(ends) else {}
    return Stages(phases, int(kept[f"{PREFIX}stages"]), values, of_bounds, of_rows)
