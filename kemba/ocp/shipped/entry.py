"""One shipped plan: its figures, its costs, its trajectory in a small file."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kemba.ocp.continuation.kept import read_stages
from kemba.ocp.phases.stages import Stages
from kemba.trajectory import Trajectory


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


def read_plan(path: Path) -> Trajectory:
    """A kept plan: states, inputs and forces in single precision, with the notes on its phases."""
    with np.load(path, allow_pickle=False) as kept:
        meta: dict[str, Any] = json.loads(str(kept["notes"]))
        values = kept["values"].astype(float)
        columns = dict(zip((str(h) for h in kept["headers"]), values, strict=True))
        return Trajectory(kept["time"], columns, meta)
