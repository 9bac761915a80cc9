"""Reading tasks, models and logs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from kemba.identify.logs.reading import read_log
from kemba.logs import ColumnMap, load_map
from kemba.model import Model
from kemba.model import load_model as load
from kemba.ocp import Task
from kemba.ocp import load_task as load_with_document
from kemba.trajectory import Trajectory

Path_ = str | Path


def load_task(name: Path_, **changes: Any) -> Task:
    """A task: a path or a shipped name such as `jump.yaml`.

    `changes` are those of `--set`: `height="0.6 m"`; keys with points go in as
    `**{"goals.apex": "0.6 m"}`. Raises KembaError with every mistake at its line.
    """
    return load_with_document(name, settings(changes))[0]


def load_model(name: Path_ = "planning", supply: float | None = None) -> Model:
    """A model: a path or a shipped name. `supply` in Pa. Raises KembaError."""
    return load(name, supply=supply)


def load_log(path: Path_, columns: ColumnMap | Path_ | None = None) -> Trajectory:
    """A log of any format that `docs/logs.md` lists; `columns` is a column map or its file.

    Raises KembaError with row and column of the first fault.
    """
    known = columns is None or isinstance(columns, ColumnMap)
    return read_log(path, columns if known else load_map(columns))  # type: ignore[arg-type]


def settings(changes: dict[str, Any]) -> list[str]:
    """Changes as the `key=value` texts of `--set`."""
    return [f"{key}={value}" for key, value in changes.items()]
