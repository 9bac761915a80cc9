"""Trajectories in other formats: MATLAB, NumPy, JSON, and CSV with another program's columns."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from kemba.errors import KembaError
from kemba.files import atomic_path, atomic_text, write_json
from kemba.identify.logs.reading import ColumnMap, Source
from kemba.quantity import convert
from kemba.trajectory import TIME, Array, Trajectory

FORMATS = ("mat", "npz", "json", "csv")


def export(trajectory: Trajectory, path: str | Path, columns: ColumnMap | None = None) -> Path:
    """Write a trajectory in the format of the ending of `path`; the path.

    .mat and .npz: one array per column, in .mat as `front_hip_tau`, and `units`. .json: columns by
    header. .csv: the log format, or with `columns` what another program reads through that map
    backwards. Raises KembaError on other endings, and when a file cannot be written.
    """
    path = Path(path)
    writers: dict[str, Callable[[Trajectory, Path], None]] = {
        "mat": _mat, "npz": _npz, "json": _json, "csv": lambda t, p: t.write(p),
    }  # fmt: skip
    ending = path.suffix.lstrip(".").lower()
    if ending not in writers:
        what = f"no format '{path.suffix}'" if path.suffix else "has no ending"
        raise KembaError(str(path), what, f"one of .{', .'.join(FORMATS)} was expected")
    if columns is not None and ending != "csv":
        raise KembaError(str(path), "a column map goes with .csv only")
    if columns is not None:
        _foreign(trajectory, path, columns)
    else:
        writers[ending](trajectory, path)
    return path


def plain_name(name: str) -> str:
    """A name that every language takes: `front_hip_tau`."""
    return re.sub(r"\W", "_", name)


def _mat(trajectory: Trajectory, path: Path) -> None:
    from scipy.io import savemat

    values = {plain_name(name): trajectory[name] for name in trajectory.names}
    units = {plain_name(name): trajectory.unit(name) for name in trajectory.names}
    content = {"time": trajectory.time, **values, "units": {"time": "s", **units}}
    with atomic_path(path) as temporary:
        savemat(temporary, content, appendmat=False, oned_as="column", long_field_names=True)


def _npz(trajectory: Trajectory, path: Path) -> None:
    values = {name: trajectory[name] for name in trajectory.names}
    units = np.array([trajectory.unit(name) for name in trajectory.names])
    content: dict[str, Any] = {"time": trajectory.time, "units": units, **values}
    with atomic_path(path) as temporary, temporary.open("wb") as stream:
        np.savez_compressed(stream, **content)


def _json(trajectory: Trajectory, path: Path) -> None:
    pairs = zip(trajectory.headers, trajectory.names, strict=True)
    columns = {TIME: trajectory.time, **{header: trajectory[name] for header, name in pairs}}
    write_json(path, {"columns": columns, "meta": trajectory.meta})


def _foreign(trajectory: Trajectory, path: Path, columns: ColumnMap) -> None:
    """The map backwards: what the other program would have recorded."""
    table = {}
    for header, source in columns.columns.items():
        name = header.split(" [")[0]
        if header == TIME or name in trajectory:
            table[source.source] = _back(trajectory, header, name, source)
    with atomic_text(path) as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(table)
        writer.writerows(zip(*(map(repr, c.tolist()) for c in table.values()), strict=True))


def _back(trajectory: Trajectory, header: str, name: str, source: Source) -> Array:
    time = trajectory.time
    values = time if header == TIME else trajectory[name]
    if source.delay:
        held = [name] if "/valve/" in f"/{name}" else []
        values = trajectory.select([name]).interpolate(time - source.delay, held)[name]
    unit = header[header.index("[") + 1 : -1]
    back = (values - source.offset) / (source.sign * source.scale)
    return np.asarray(convert(back, unit, source.unit or unit), dtype=float)
