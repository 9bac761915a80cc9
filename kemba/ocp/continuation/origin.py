"""Earlier plans as origins, their solved programs in a file."""

import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kemba.files import atomic_path
from kemba.model import Model
from kemba.model.rest import told_by
from kemba.ocp.phases.modes import Phase
from kemba.ocp.phases.stages import Stages
from kemba.ocp.task.requirement import Requirement
from kemba.trajectory import Trajectory


@dataclass(frozen=True)
class Origin:
    """An earlier plan, the model it was made with, and what was asked of it.

    `name`: what sentences call it; `dear`: what to do where the new plan costs much more. `once`:
    where the earlier phases do not fit, they are not read anew. `ticks`: valve edges of the new
    plan are on the controller's ticks; where that fails at once, these ticks do not fit, and
    nothing else is tried. `finer`: its elements have five stages. `stages`: the solved program of
    the plan, where it is at hand. `run`: its folder; `given`: whether the user named it.
    """

    plan: Trajectory
    model: Model
    requirements: tuple[Requirement, ...]
    name: str = "the earlier plan"
    dear: str = "one without --from may take less"
    once: bool = False
    ticks: bool = False
    finer: bool = False
    stages: Stages | None = None
    run: str = ""
    given: bool = True


def completed(plan: Trajectory, model: Model) -> Trajectory:
    """The plan with every column that `model` names: new states as what the plan has of outputs
    tells, such as pressures by the forces of their chambers, else at rest; new forces and inputs
    zero."""
    absent = {
        q.header: np.full(len(plan), float(q.value) if name == "s" else 0.0)
        for name in ("s", "u", "lam")
        for q in model.groups[name]
        if q.name not in plan
    }
    states = list(model.states.values())
    rest = np.array([q.value for q in states], dtype=float)
    told = told_by(model, rest, plan)
    absent |= {
        q.header: np.clip(told[i], q.lower, q.upper) for i, q in enumerate(states) if i in told
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
