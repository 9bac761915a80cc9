"""The solved program of a run in its folder, from which `solve --from` begins at once."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from kemba.files import atomic_path
from kemba.ocp.phases.modes import Phase
from kemba.ocp.phases.stages import Stages

ROWS = "rows "  # before the label of rows


def write_stages(file: Path, stages: Stages) -> None:
    """Write `stages.npz` of a run folder. Raises KembaError where it cannot be written."""
    phases = stages.phases
    arrays: dict[str, Any] = {
        "borders": np.array([(p.first, p.last) for p in phases]),
        "modes": np.array([p.modes for p in phases]),
        "valves": np.array([p.valves for p in phases]),
        "stages": np.array(stages.stages),
        "values": stages.values,
        "of_bounds": stages.of_bounds,
        **{f"{ROWS}{label}": table for label, table in stages.of_rows.items()},
    }
    with atomic_path(file) as path, path.open("wb") as stream:
        np.savez(stream, **arrays)


def read_stages(file: Path) -> Stages | None:
    """What the file holds; None where there is none or it cannot be read: a plan is then begun from
    its nodes."""
    try:
        with file.open("rb") as stream:
            kept = np.load(stream, allow_pickle=False)
            rows = zip(kept["borders"], kept["modes"], kept["valves"], strict=True)
            phases = tuple(
                Phase(int(first), int(last), tuple(modes.tolist()), tuple(valves.tolist()))
                for (first, last), modes, valves in rows
            )
            labels = [name.removeprefix(ROWS) for name in kept if name.startswith(ROWS)]
            of_rows = {label: kept[f"{ROWS}{label}"].reshape(-1, 2) for label in labels}
            values, of_bounds = kept["values"].ravel(), kept["of_bounds"].ravel()
            count = int(kept["stages"])
            numbers = values, of_bounds, *of_rows.values()
            right = phases and all(np.isfinite(array).all() for array in numbers)
    except (OSError, KeyError, IndexError, ValueError, TypeError, EOFError, zipfile.BadZipFile):
        return None
    return Stages(phases, count, values, of_bounds, of_rows) if right else None
