"""Logs as Parquet tables, one column each."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from kemba.errors import KembaError
from kemba.files import atomic_path, plain
from kemba.logs.formats import check_size
from kemba.logs.recording import Recording
from kemba.trajectory import TIME, Trajectory

META = b"kemba"


def write_parquet(trajectory: Trajectory, path: Path) -> None:
    """One column per header; the metadata are in the schema as JSON."""
    values = [trajectory.time, *(trajectory[name] for name in trajectory.names)]
    headers = [TIME, *trajectory.headers]
    table = pa.table(dict(zip(headers, values, strict=True)))
    meta = {META: json.dumps(plain(trajectory.meta)).encode()}
    with atomic_path(path) as temporary:
        pq.write_table(table.replace_schema_metadata(meta), temporary, write_page_checksum=True)


def read_parquet(path: Path) -> Recording:
    """The columns, numbers as floats, times as whole ns, anything else as texts; the metadata.
    Raises KembaError for damaged files."""
    try:
        with pq.ParquetFile(path) as file:
            found = file.metadata
        check_size(path, 8 * found.num_rows * found.num_columns)
        table = pq.read_table(path, page_checksum_verification=True)
    except OSError as error:
        raise KembaError(str(path), error.strerror or str(error)) from None
    except pa.ArrowException as error:
        raise KembaError(str(path), f"is no Parquet file: {error}") from None
    try:
        meta = json.loads((table.schema.metadata or {}).get(META, b"{}"))
    except ValueError:
        raise KembaError(str(path), "its metadata 'kemba' are no JSON") from None
    columns = dict(zip(table.column_names, table.columns, strict=True))
    units = {name: "ns" for name, column in columns.items() if _is_time(column)}
    return Recording({name: _values(c) for name, c in columns.items()}, meta, units=units)


def _is_time(column: pa.ChunkedArray) -> bool:
    kind = column.type
    return bool(column.null_count == 0) and bool(
        pa.types.is_timestamp(kind) or pa.types.is_duration(kind)
    )


def _values(column: pa.ChunkedArray) -> np.ndarray[Any, Any]:
    kind = column.type
    if _is_time(column):
        unit = pa.duration("ns") if pa.types.is_duration(kind) else pa.timestamp("ns", kind.tz)
        return np.asarray(column.cast(unit).cast(pa.int64()).to_numpy())
    if pa.types.is_integer(kind) and column.null_count == 0:
        return np.asarray(column.to_numpy())  # stamps since 1970 exceed a float
    if pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_boolean(kind):
        return np.asarray(column.cast(pa.float64()).to_numpy(), dtype=float)
    return np.array(["" if v is None else str(v) for v in column.to_pylist()], dtype=object)
