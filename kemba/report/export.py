"""Trajectories in other formats: MATLAB, NumPy, JSON, and CSV with another program's columns."""

import csv
from pathlib import Path

import numpy as np

from kemba.errors import KembaError
from kemba.files import atomic_text
from kemba.folders import ended
from kemba.logs import ColumnMap, Columns, ColumnSource, map_of
from kemba.logs.formats import MODULES, writer
from kemba.quantity import convert
from kemba.trajectory import TIME, Array, Trajectory

FORMATS = (".csv", *(f".{ending}" for ending in MODULES))


def export(trajectory: Trajectory, path: str | Path, columns: Columns = None) -> Path:
    """Write the `trajectory` in the format of the ending of `path`; the path.

    .csv: the log format, or with `columns` what another program reads through that map backwards.
    .mcap: one topic per part, for PlotJuggler and Foxglove. .parquet and .json: columns by header.
    .mat and .npz: one array per column, in .mat as `front_hip_tau`, and `units`. Raises KembaError
    on other endings, and when a file cannot be written.
    """
    path, columns = ended(path, FORMATS), map_of(columns)
    text = path.suffix.lower() == ".csv"
    if columns is not None and not text:
        raise KembaError(str(path), "a column map goes with .csv only")
    if columns is not None:
        _foreign(trajectory, path, columns)
    elif text:
        trajectory.write(path)
    else:
        writer(path)(trajectory, path)
    return path


def _foreign(trajectory: Trajectory, path: Path, layout: ColumnMap) -> None:
    """The map backwards: what the other program would have recorded."""
    table: dict[str, list[str]] = {}
    for header, source in layout.columns.items():
        name = header.split(" [")[0]
        if header == TIME or name in trajectory:
            values = _back(trajectory, header, name, source).tolist()
            table[str(source.source)] = [repr(v).replace(".", layout.decimal) for v in values]
            if source.add is not None:
                table[str(source.add.source)] = ["0"] * len(values)
    if not layout.header:
        last = max(map(int, table))
        empty = [""] * len(trajectory)
        table = {str(n): table.get(str(n), empty) for n in range(1, last + 1)}
    with atomic_text(path) as stream:
        separator = {"tab": "\t", "whitespace": " "}.get(layout.separator, layout.separator)
        stream.write("\n" * layout.skip_rows)
        writer = csv.writer(stream, lineterminator="\n", delimiter=separator)
        writer.writerows([list(table)] * (layout.header + layout.skip_below))
        writer.writerows(zip(*table.values(), strict=True))


def _back(trajectory: Trajectory, header: str, name: str, source: ColumnSource) -> Array:
    time = trajectory.time
    values = time if header == TIME else trajectory[name]
    if source.delay:
        held = [name] if "/valve/" in f"/{name}" else []
        values = trajectory.select([name]).interpolate(time - source.delay, held)[name]
    if source.threshold is not None:
        off, on = sorted((0.0, 2 * source.level() or 1.0))[:: source.sign]
        return np.where(np.isnan(values), np.nan, np.where(values > 0.5, on, off))
    unit = header[header.index("[") + 1 : -1]
    back = (values - source.offset_in(unit)) / (source.sign * source.scale)
    return np.asarray(convert(back, unit, source.unit or unit), dtype=float)
