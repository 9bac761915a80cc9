"""Open a log of any format: its own columns, or foreign ones through a map."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from kemba.config import load_yaml
from kemba.errors import KembaError, map_hint
from kemba.logs.columns import ColumnMap
from kemba.logs.foreign import mapped
from kemba.logs.formats import MODULES, reader
from kemba.logs.text import Raw, read_text
from kemba.trajectory import TIME, Trajectory, check_times, sidecar

TEXTS = (".csv", ".txt", ".tsv", ".dat")
BINARY = tuple(f".{ending}" for ending in MODULES)
ENDINGS = (*TEXTS, *BINARY)
YAML = (".yaml", ".yml")


def open_log(path: Path, columns: ColumnMap | None = None, strict: bool = True) -> Trajectory:
    """The log in a file, with what its sidecar says.

    `strict=False` lets times pass that do not increase. Raises KembaError with the place of the
    first fault, and where foreign columns need a map.
    """
    if path.is_dir():
        raise KembaError(str(path), "is a folder", "a log was expected")
    _no_yaml(path)
    if path.suffix.lower() not in BINARY and columns is None:
        return Trajectory.read(path, strict)
    raw, meta = raw_columns(path, columns)
    meta = {**meta, **_sidecar(path)}
    log = _own(raw, path, meta) if columns is None else mapped(raw, columns, path, meta)
    if strict:
        check_times(log.time, str(path), first_row=2)
    return log


def raw_columns(path: Path, layout: ColumnMap | None) -> tuple[Raw, dict[str, Any]]:
    """All columns of a file as they are, and the metadata it holds. Raises KembaError."""
    if not path.is_file():
        raise KembaError(str(path), "is a folder" if path.is_dir() else "no such file")
    _no_yaml(path)
    if path.suffix.lower() in BINARY:
        return reader(path)(path)
    if layout is None:
        raise KembaError(str(path), "a column map says how to read a text table")
    return read_text(path, layout), {}


def _no_yaml(path: Path) -> None:
    if path.suffix.lower() in YAML:
        endings = ", ".join(ENDINGS)
        raise KembaError(str(path), "is a YAML file", f"a log was expected: {endings}")


def _own(raw: Raw, path: Path, meta: dict[str, Any]) -> Trajectory:
    if TIME not in raw:
        what = f"has no column '{TIME}'"
        raise KembaError(str(path), what, hint=map_hint(path))
    texts = [name for name, values in raw.items() if values.dtype == object and name != TIME]
    columns = {n: np.asarray(v, dtype=float) for n, v in raw.items() if n not in (TIME, *texts)}
    return Trajectory(np.asarray(raw[TIME], dtype=float), columns, meta)


def _sidecar(path: Path) -> dict[str, Any]:
    found = load_yaml(sidecar(path)).data if sidecar(path).is_file() else {}
    return found if isinstance(found, dict) else {}
