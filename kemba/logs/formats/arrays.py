"""Logs as named arrays: NumPy .npz and JSON."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from kemba.errors import KembaError
from kemba.files import atomic_path, plain
from kemba.files import write_json as write_json_file
from kemba.logs.formats import check_size
from kemba.logs.text import Raw
from kemba.trajectory import TIME, Trajectory

Found = tuple[Raw, dict[str, Any]]
BROKEN = (ValueError, TypeError, KeyError, EOFError, NotImplementedError, zipfile.BadZipFile)


def write_npz(trajectory: Trajectory, path: Path) -> None:
    """One array per column by name, and `units` and `meta` (JSON)."""
    values = {name: trajectory[name] for name in trajectory.names}
    units = np.array([trajectory.unit(name) for name in trajectory.names])
    meta = np.array(json.dumps(plain(trajectory.meta)))
    content: dict[str, Any] = {"time": trajectory.time, "units": units, "meta": meta, **values}
    with atomic_path(path) as temporary, temporary.open("wb") as stream:
        np.savez_compressed(stream, **content)


def read_npz(path: Path) -> Found:
    """Our own .npz by its units; else every vector of the length that most vectors have."""
    try:
        with zipfile.ZipFile(path) as packed:
            check_size(path, sum(member.file_size for member in packed.infolist()))
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
            content = {name: file[name] for name in file.files}
    except (*BROKEN, OSError) as error:
        raise KembaError(str(path), f"is no .npz file of numbers: {error}") from None
    if "units" not in content or "time" not in content:
        return vectors(content, path), {}
    names = [name for name in content if name not in ("time", "units", "meta")]
    units = np.atleast_1d(content["units"]).tolist()
    if len(units) != len(names):
        raise KembaError(str(path), f"has {len(units)} units for {len(names)} columns")
    pairs = zip(names, units, strict=True)
    columns = {f"{name} [{unit}]": content[name] for name, unit in pairs}
    return {TIME: content["time"], **columns}, metadata(content.get("meta"))


def write_json(trajectory: Trajectory, path: Path) -> None:
    """Columns by header, and the metadata."""
    pairs = zip(trajectory.headers, trajectory.names, strict=True)
    columns = {TIME: trajectory.time, **{header: trajectory[name] for header, name in pairs}}
    write_json_file(path, {"columns": columns, "meta": trajectory.meta})


def read_json(path: Path) -> Found:
    """Columns by name, under `columns` or at the top; null is a missing reading."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        columns = content.get("columns", content)
        found = {k: np.array(v, dtype=float) for k, v in columns.items() if isinstance(v, list)}
    except OSError as error:
        raise KembaError(str(path), error.strerror or str(error)) from None
    except (ValueError, TypeError, AttributeError, RecursionError) as error:
        raise KembaError(str(path), f"is no JSON object of columns: {error}") from None
    meta = content.get("meta", {})
    return vectors(found, path), meta if isinstance(meta, dict) else {}


def vectors(content: dict[str, Any], path: Path) -> Raw:
    """The vectors of numbers that share the most frequent length."""
    arrays = {name: np.squeeze(np.asarray(value)) for name, value in content.items()}
    vectors = {n: a for n, a in arrays.items() if a.ndim == 1 and a.dtype.kind in "fiub"}
    if not vectors:
        raise KembaError(
            str(path), "holds no vector of numbers", "one for each column was expected"
        )
    lengths = [len(a) for a in vectors.values()]
    length = max(set(lengths), key=lambda n: (lengths.count(n), n))
    return {name: np.asarray(a, dtype=float) for name, a in vectors.items() if len(a) == length}


def metadata(text: Any) -> dict[str, Any]:
    """The metadata in a text of JSON; none where it is no such text."""
    try:
        found = json.loads(str(text))
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}
