"""One shipped plan: its figures, its costs, its trajectory in a small file."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kemba.model import Model
from kemba.ocp.transcription.solution import groups
from kemba.trajectory import Trajectory

KEPT = ("phase_constraints", "phases")


@dataclass(frozen=True)
class Entry:
    """A shipped plan.

    `kind`: fingerprint of its task and model (`kind_of`). `figures`: height [m], distance [m],
    supply [Pa], payload [kg], duration [s], as far as the task has them. `cost`: what its task
    counts. `of`: among how many plans of these figures it was chosen.
    """

    file: Path
    kind: str
    figures: dict[str, float]
    cost: float
    of: int

    @property
    def plan(self) -> Trajectory:
        """Its states, inputs and forces, with the notes on its phases."""
        return read_plan(self.file)

    @property
    def name(self) -> str:
        """The name of its file, without the ending."""
        return self.file.stem


def write_plan(path: Path, plan: Trajectory, model: Model) -> None:
    """Keep what a start needs: states, inputs and forces, in single precision, and the phases."""
    headers = [q.header for group in groups(model).values() for q in group]
    values = np.array([plan[q.name] for group in groups(model).values() for q in group])
    notes = json.dumps({key: plan.meta[key] for key in KEPT})
    np.savez_compressed(
        path,
        time=plan.time,
        values=values.astype(np.float32),
        headers=np.array(headers),
        notes=np.array(notes),
    )


def read_plan(path: Path) -> Trajectory:
    """The plan that `write_plan` kept."""
    with np.load(path, allow_pickle=False) as kept:
        meta: dict[str, Any] = json.loads(str(kept["notes"]))
        values = kept["values"].astype(float)
        columns = dict(zip((str(h) for h in kept["headers"]), values, strict=True))
        return Trajectory(kept["time"], columns, meta)
