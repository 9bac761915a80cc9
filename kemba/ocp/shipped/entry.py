"""One shipped plan: its figures, its costs, its trajectory in a small file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kemba.model import Model
from kemba.ocp.continuation.kept import packed, read_stages
from kemba.ocp.phases.stages import Stages
from kemba.ocp.transcription.solution import groups
from kemba.trajectory import Trajectory

KEPT = ("phase_constraints", "phases")


@dataclass(frozen=True)
class Entry:
    """A shipped plan.

    `kind`: fingerprint of its task and model (`kind_of`). `figures`: height [m], distance [m],
    supply [Pa], payload [kg], duration [s], as far as the task has them. `cost`: what its task
    counts. `of`: among how many plans of these figures it was chosen. `landed`: in how many of 60
    scenarios at twice the usual uncertainty it lands.
    """

    file: Path
    kind: str
    figures: dict[str, float]
    cost: float
    of: int
    landed: int = 0

    @property
    def plan(self) -> Trajectory:
        """Its states, inputs and forces, with the notes on its phases."""
        return read_plan(self.file)

    @property
    def stages(self) -> Stages | None:
        """Its solved program; None where it was not kept."""
        return read_stages(self.file)

    @property
    def effects(self) -> dict[str, dict[str, Any]]:
        """The parameters of effects with which it was made, where they are not the model's, as a
        task's `effects`."""
        return dict(self.plan.meta.get("effects", {}))

    @property
    def way(self) -> str:
        """The order of its valves and contacts: what a plan has in common with one that begins
        from it."""
        return json.dumps([str(phase).partition(" ")[2] for phase in self.plan.meta["phases"]])

    @property
    def name(self) -> str:
        """The name of its file, without the ending."""
        return self.file.stem


def write_plan(
    path: Path,
    plan: Trajectory,
    model: Model,
    air: Mapping[str, Any] | None = None,
    stages: Stages | None = None,
) -> None:
    """Keep what a start needs in single precision: states, inputs and forces, the phases, and the
    solved program (`stages`).

    `air`: `effects` and `fitted_air` of a plan whose air was fitted.
    """
    headers = [q.header for group in groups(model).values() for q in group]
    values = np.array([plan[q.name] for group in groups(model).values() for q in group])
    notes = json.dumps({**{key: plan.meta[key] for key in KEPT}, **(air or {})})
    np.savez_compressed(
        path,
        time=plan.time,
        values=values.astype(np.float32),
        headers=np.array(headers),
        notes=np.array(notes),
        **(packed(stages, small=True) if stages else {}),
    )


def read_plan(path: Path) -> Trajectory:
    """The plan that `write_plan` kept."""
    with np.load(path, allow_pickle=False) as kept:
        meta: dict[str, Any] = json.loads(str(kept["notes"]))
        values = kept["values"].astype(float)
        columns = dict(zip((str(h) for h in kept["headers"]), values, strict=True))
        return Trajectory(kept["time"], columns, meta)
