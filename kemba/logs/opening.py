"""Open a log of any format: its own columns, or foreign ones through a map."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from kemba.config import load_yaml
from kemba.errors import KembaError, map_hint
from kemba.logs.columns import ColumnMap
from kemba.logs.foreign import mapped
from kemba.logs.formats import READERS, reader
from kemba.logs.recording import Raw, Recording
from kemba.logs.text import read_text
from kemba.table import check_headers
from kemba.trajectory import TIME, Array, Trajectory, check_times, sidecar

TEXTS = (".csv", ".txt", ".tsv", ".dat")
BINARY = tuple(f".{ending}" for ending in READERS)
ENDINGS = (*TEXTS, *BINARY)
YAML = (".yaml", ".yml")
LONGEST = 200  # characters of another program's message


def log_files(paths: Iterable[str | Path]) -> list[Path]:
    """Logs; a folder stands for its CSV files, in the order of their names.

    Raises KembaError for a folder without any.
    """
    found: list[Path] = []
    for path in map(Path, paths):
        if not path.is_dir():
            found.append(path)
            continue
        inside = sorted(path.glob("*.csv"))
        if not inside:
            hint = "kemba-opt simulate RUN --noise writes some"
            raise KembaError(str(path), "is a folder without logs", "CSV files were expected", hint)
        found += inside
    return found


def open_log(path: Path, columns: ColumnMap | None = None, strict: bool = True) -> Trajectory:
    """The log in a file, with what its sidecar says.

    `strict=False` lets times pass that do not increase. Raises KembaError with the place of the
    first fault, and where foreign columns need a map.
    """
    if path.is_dir() and not is_recorded(path):
        raise KembaError(str(path), "is a folder", "a log was expected")
    _no_yaml(path)
    if not path.is_dir() and path.suffix.lower() not in BINARY and columns is None:
        return Trajectory.read(path, strict)
    raw = raw_columns(path, columns)
    raw = replace(raw, meta={**raw.meta, **_sidecar(path)})
    log = _own(raw, path) if columns is None else mapped(raw, columns, path)
    if strict:
        check_times(log.time, str(path), first_row=2)
    return log


def is_recorded(path: Path) -> bool:
    """Whether a folder is one recording, as rosbag2 writes it."""
    return (path / "metadata.yaml").is_file()


def raw_columns(path: Path, layout: ColumnMap | None) -> Recording:
    """All columns of a file as they are, and the metadata it holds. Raises KembaError."""
    if not path.is_file() and not is_recorded(path):
        raise KembaError(str(path), "is a folder" if path.is_dir() else "no such file")
    _no_yaml(path)
    if path.is_dir() or path.suffix.lower() in BINARY:
        return _binary(path)
    if layout is None:
        raise KembaError(str(path), "a column map says how to read a text table")
    return Recording(read_text(path, layout))


def _no_yaml(path: Path) -> None:
    if path.suffix.lower() in YAML:
        endings = ", ".join(ENDINGS)
        raise KembaError(str(path), "is a YAML file", f"a log was expected: {endings}")


def _binary(path: Path) -> Recording:
    """The columns (n,) of numbers or objects of a file that may be damaged."""
    try:
        raw = reader(path)(path)
    except (KembaError, MemoryError):
        raise
    except Exception as error:  # what reads the formats of others raises anything on such bytes
        reason = f"{type(error).__name__}: {error}"[:LONGEST]
        what = f"is damaged, or no {path.suffix} file of a log: {reason}"
        raise KembaError(str(path), what) from None
    columns = {name: _cells(values) for name, values in raw.columns.items()}
    first = next(iter(columns), "")
    for name, values in columns.items():
        like = raw.clocks.get(name, name if name in raw.clocks.values() else first)
        length = len(columns[like]) if like in columns else 0
        if values.shape != (length,):
            what = f"'{name}' has the shape {values.shape}"
            raise KembaError(str(path), what, f"({length},) as '{like}' was expected")
    return replace(raw, columns=columns, meta=raw.meta if isinstance(raw.meta, dict) else {})


def _cells(values: Any) -> np.ndarray[Any, Any]:
    """Numbers as they are, dates and texts as texts."""
    cells = np.atleast_1d(np.asarray(values))
    return cells if cells.dtype.kind in "fiubO" else cells.astype(str).astype(object)


def _own(raw: Recording, path: Path) -> Trajectory:
    if TIME not in raw.columns:
        what = f"has no column '{TIME}'; it holds {held(raw.columns)}"
        raise KembaError(str(path), what, hint=map_hint(path))
    numbers = {name: found for name, v in raw.columns.items() if (found := _numbers(v)) is not None}
    if TIME not in numbers or raw.units.get(TIME, "s") != "s":
        raise KembaError(str(path), f"'{TIME}' holds no numbers", hint=map_hint(path))
    check_headers([TIME, *(n for n in numbers if n != TIME)], path, lambda _: str(path))
    for name, values in numbers.items():
        if np.isinf(values).any():
            row = int(np.argmax(np.isinf(values))) + 1
            raise KembaError(str(path), f"'{name}' is infinite in row {row}")
    said = {"read": list(raw.remarks)} if raw.remarks else {}
    return Trajectory(numbers.pop(TIME), numbers, {**raw.meta, **said})


def held(columns: Raw) -> str:
    """What a file holds, in words."""
    names = [f"'{name}'" for name in list(columns)[:6]]
    more = f" and {len(columns) - 6} more" if len(columns) > 6 else ""
    return f"{', '.join(names)}{more}"


def _numbers(values: np.ndarray[Any, Any]) -> Array | None:
    """A column as numbers; None where it holds texts."""
    if values.dtype == object and not all(isinstance(v, int | float) for v in values):
        return None
    try:
        return np.asarray(values, dtype=float)
    except OverflowError:
        return None


def _sidecar(path: Path) -> dict[str, Any]:
    found = load_yaml(sidecar(path)).data if sidecar(path).is_file() else {}
    return found if isinstance(found, dict) else {}
