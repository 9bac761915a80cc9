"""The solved program of a plan in a file, from which it is continued at once."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from kemba.files import atomic_path
from kemba.ocp.phases.modes import Phase
from kemba.ocp.phases.stages import Stages

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
