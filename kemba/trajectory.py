"""Trajectories: times and named columns with units, the only thing exchanged between verbs."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from itertools import chain
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from kemba.config.document import dump_yaml, load_yaml
from kemba.errors import KembaError, map_hint, suggest
from kemba.files import atomic_text
from kemba.quantity import Quantity, is_si

Array = np.ndarray[Any, np.dtype[np.float64]]


def read_table(path: str | Path) -> tuple[list[str], Array]:
    """Headers (k) and numbers (n, k) of a CSV file; an empty cell is NaN.

    Raises KembaError with file:row:column when the file cannot be read, a header is malformed,
    repeated or not SI, rows are ragged or a cell is not a number.
    """
    try:
        with open(path, encoding="utf-8-sig", newline=None) as stream:
            headers = _headers(stream, path)
            check_headers(headers, path, lambda column: f"{path}:1:{column}")
            try:
                table = _numbers(stream, len(headers))
            except ValueError as error:
                raise _culprit(path, headers) or KembaError(str(path), str(error)) from None
    except OSError as error:
        raise KembaError(str(path), error.strerror or str(error)) from None
    except UnicodeDecodeError:
        raise KembaError(str(path), "is not a UTF-8 text", "a CSV file was expected") from None
    if np.isinf(table).any():
        row, column = np.argwhere(np.isinf(table))[0]
        raise KembaError(f"{path}:{row + 2}:{column + 1}", "the number is infinite")
    return headers, table


def _headers(stream: TextIO, path: str | Path) -> list[str]:
    line = stream.readline()
    if not line.strip():
        raise KembaError(
            str(path), "is empty", "a header row starting with 'time [s]' was expected"
        )
    if ";" in line and "," not in line:
        what = "is separated by semicolons"
        expected = "commas, and decimal points, were expected"
        raise KembaError(f"{path}:1", what, expected, map_hint(path))
    return [cell.strip() for cell in _cells(line)]


def _cells(line: str) -> list[str]:
    """The cells of one line, whatever its length."""
    if len(line) > csv.field_size_limit():
        return line.rstrip("\n").split(",")
    return next(csv.reader([line.rstrip("\n")]), [])


def check_headers(headers: Iterable[str], path: str | Path, place: Callable[[int], str]) -> None:
    """Check that headers of a log are well formed, in SI and different.

    `place` of a column, from 1. Raises KembaError there.
    """
    seen: dict[str, int] = {}
    for column, header in enumerate(headers, start=1):
        where = place(column)
        try:
            quantity = Quantity.from_header(header)
        except KembaError as error:
            leave = "take the column out, or " if column > 1 else ""  # the others are kemba's
            hint = leave + map_hint(path)
            raise KembaError(where, error.what, error.expected, hint) from None
        if not is_si(quantity.unit):
            what = f"'{header}' is not in SI units"
            raise KembaError(where, what, "SI inside the file was expected", map_hint(path))
        if quantity.name in seen:
            what = f"column '{quantity.name}' stands twice"
            raise KembaError(where, what, hint=f"it is column {seen[quantity.name]} already")
        seen[quantity.name] = column


def _numbers(stream: TextIO, width: int) -> Array:
    """The rows below the header (n, width); ValueError when one is faulty."""
    rows = _filled(stream, width)
    first = next(rows, None)
    if first is None:
        return np.empty((0, width))
    table = np.loadtxt(chain([first], rows), delimiter=",", ndmin=2, comments=None, quotechar='"')
    if table.shape[1] != width:
        raise ValueError(f"{table.shape[1]} columns below {width} headers")
    return table


def _filled(stream: TextIO, width: int) -> Iterator[str]:
    """The rows that are not blank, with `nan` in empty cells."""
    for line in stream:
        row = line.rstrip("\n")
        if ",," in row or row.startswith(",") or row.endswith(",") or " " in row:
            row = re.sub(r"(?<![^,])\s*(?![^,])", "nan", row)
        if row:
            yield row


def _culprit(path: str | Path, headers: list[str]) -> KembaError | None:
    """The first faulty cell, found by reading cell by cell."""
    with open(path, encoding="utf-8-sig", newline=None) as stream:
        stream.readline()
        for number, line in enumerate(stream, start=2):
            cells = _cells(line)
            if line.count('"') % 2:
                return KembaError(f"{path}:{number}", "has a quote that nothing closes")
            if cells and len(cells) != len(headers):
                what = f"{len(cells)} cells below {len(headers)} headers"
                return KembaError(f"{path}:{number}", what)
            for column, cell in enumerate(cells, start=1):
                if cell.strip() and not _is_number(cell):
                    what = f"{headers[column - 1]}: '{cell}' is not a number"
                    return KembaError(f"{path}:{number}:{column}", what)
    return None


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return "_" not in cell  # Python reads 1_000, CSV readers do not


TIME = "time [s]"
LISTED = 4  # columns in a repr
SAME_TIME = 1e-9  # s; times closer than this are one


class Trajectory:
    """A plan, a simulation or a measurement: `time` (n,) in s and columns (n,) in SI units.

    Columns are given by header, `{"body/z [m]": z}`, and read by name, `t["body/z"]`; NaN means
    not measured. `meta` is what the sidecar file says. Raises KembaError on a malformed or
    repeated header and on columns that are not as long as `time`.
    """

    def __init__(
        self, time: Any, columns: Mapping[str, Any], meta: Mapping[str, Any] | None = None
    ) -> None:
        self.time: Array = np.asarray(time, dtype=float)
        self.meta = dict(meta or {})
        self._columns: dict[str, Array] = {}
        self._units: dict[str, str] = {}
        if self.time.ndim != 1:
            raise KembaError("time [s]", f"has the shape {self.time.shape}", "(n,) was expected")
        for header, values in columns.items():
            self._add(Quantity.from_header(header), np.asarray(values, dtype=float))

    def _add(self, quantity: Quantity, values: Array) -> None:
        if quantity.name in self._columns or quantity.name == "time":
            raise KembaError(quantity.header, "this column stands twice")
        if values.shape != self.time.shape:
            expected = f"{self.time.shape} as the time was expected"
            raise KembaError(quantity.header, f"has the shape {values.shape}", expected)
        self._columns[quantity.name] = values
        self._units[quantity.name] = quantity.unit

    def __len__(self) -> int:
        return len(self.time)

    def __contains__(self, name: object) -> bool:
        return name in self._columns

    def __getitem__(self, name: str) -> Array:
        """The column `name` (n,), in SI; KembaError with the nearest name when there is none."""
        self._known(name)
        return self._columns[name]

    def __repr__(self) -> str:
        more = f" and {len(self.names) - LISTED} more" if len(self.names) > LISTED else ""
        span = f", {self.time[-1] - self.time[0]:.3g} s" if len(self) else ""
        return f"Trajectory({len(self)} rows{span}: {', '.join(self.headers[:LISTED])}{more})"

    def keys(self) -> tuple[str, ...]:
        """The columns' names, so that `dict(trajectory)` holds all columns."""
        return self.names

    def values(self) -> tuple[Array, ...]:
        """The columns (n,) in the order of their names."""
        return tuple(self._columns.values())

    def items(self) -> Iterator[tuple[str, Array]]:
        """Names and columns (n,)."""
        return iter(self._columns.items())

    def __iter__(self) -> Iterator[str]:
        """The columns' names. As in pandas, `len` counts rows, not names."""
        return iter(self._columns)

    def get(self, name: str, default: Any = None) -> Any:
        """The column `name` (n,), or `default` where there is none."""
        return self._columns.get(name, default)

    @property
    def columns(self) -> dict[str, Array]:
        """The columns (n,) by header, without the time."""
        return dict(zip(self.headers, self._columns.values(), strict=True))

    def to_pandas(self) -> Any:
        """A DataFrame: columns by header, the time [s] as index."""
        import pandas as pd

        return pd.DataFrame(self.columns, index=pd.Index(self.time, name=TIME))

    def _repr_html_(self) -> str:
        """The first and last rows, for notebooks."""
        return str(self.to_pandas()._repr_html_())

    @property
    def names(self) -> tuple[str, ...]:
        """The columns' names in order, without the time."""
        return tuple(self._columns)

    @property
    def headers(self) -> tuple[str, ...]:
        """The columns' headers in order, without the time."""
        return tuple(f"{name} [{unit}]" for name, unit in self._units.items())

    def unit(self, name: str) -> str:
        """The unit of column `name`; KembaError when there is none."""
        self._known(name)
        return self._units[name]

    def select(self, names: Iterable[str]) -> Trajectory:
        """The same times with the columns `names` only, in that order."""
        columns = {f"{name} [{self.unit(name)}]": self[name] for name in names}
        return Trajectory(self.time, columns, self.meta)

    def with_columns(self, columns: Mapping[str, Any]) -> Trajectory:
        """The same with `columns` (n,), given by header, added or replaced."""
        replaced = {Quantity.from_header(header).name for header in columns}
        kept = self.select(name for name in self.names if name not in replaced)
        return Trajectory(self.time, {**kept.columns, **columns}, self.meta)

    def rows(self, chosen: Any) -> Trajectory:
        """The rows `chosen` by an index, a slice or a mask (n,)."""
        columns = {header: values[chosen] for header, values in self.columns.items()}
        return Trajectory(self.time[chosen], columns, self.meta)

    def at_times(self, time: Array) -> Trajectory:
        """The same columns at other times, `time` (n,) [s]."""
        return Trajectory(time, self.columns, self.meta)

    def held(self, name: str, times: Array) -> Array:
        """Column `name` at `times` of any shape [s]: each row holds until the next, and the first
        before it."""
        row = np.searchsorted(self.time, times + SAME_TIME, side="right") - 1
        return np.asarray(self[name][np.maximum(row, 0)])

    def interpolate(self, times: Any, hold: Collection[str] = ()) -> Trajectory:
        """The columns at `times` (m,) in s, linear in between; those in `hold` keep their value.

        Before the first and after the last row the end values are used.
        """
        for name in hold:
            self._known(name)
        times = np.asarray(times, dtype=float)
        held = np.clip(np.searchsorted(self.time, times, side="right") - 1, 0, None)
        columns = {}
        for (name, values), header in zip(self.items(), self.headers, strict=True):
            columns[header] = values[held] if name in hold else np.interp(times, self.time, values)
        return Trajectory(times, columns, self.meta)

    def write(self, path: str | Path) -> None:
        """Write a CSV to `path`, and the sidecar when there is metadata; reading it back is exact.
        Raises KembaError when the times are not strictly increasing."""
        check_times(self.time, str(path))
        texts = [_texts(self.time), *(_texts(values) for values in self._columns.values())]
        with atomic_text(path) as stream:
            stream.write(",".join((TIME, *self.headers)) + "\n")
            stream.writelines(",".join(row) + "\n" for row in zip(*texts, strict=True))
        if self.meta:
            dump_yaml(self.meta, sidecar(path))

    @classmethod
    def read(cls, path: str | Path, strict: bool = True) -> Trajectory:
        """The trajectory in the CSV at `path`, with its sidecar.

        `strict=False` lets through no rows and times that do not increase, for readers who judge
        the data themselves. Raises KembaError with file:row:column of the first fault.
        """
        headers, table = read_table(path)
        if headers[0] != TIME:
            hint = map_hint(path) if TIME not in headers else ""
            raise KembaError(
                f"{path}:1:1", f"the first column is '{headers[0]}'", f"'{TIME}' was expected", hint
            )
        if strict and not len(table):
            raise KembaError(str(path), "has no rows below its header")
        if strict:
            check_times(table[:, 0], str(path))
        meta = load_yaml(sidecar(path)).data if sidecar(path).is_file() else {}
        if not isinstance(meta, dict | None):
            raise KembaError(str(sidecar(path)), "has no keys", "such as 'kind: robot'")
        columns = dict(zip(headers[1:], table[:, 1:].T, strict=True))
        return cls(table[:, 0], columns, meta)

    def _known(self, name: str) -> None:
        if name not in self._columns:
            raise KembaError("", f"no column '{name}'", hint=suggest(name, self._columns))


def sidecar(path: str | Path) -> Path:
    """The metadata file beside a CSV: `jump.csv` has `jump.meta.yaml`."""
    return Path(path).with_suffix(".meta.yaml")


def check_times(time: Array, where: str) -> None:
    """Raise KembaError at the first of the times (n,) that is not finite or does not increase, by
    its row in a table with one row of headers."""
    wrong = ~np.isfinite(time)
    wrong[1:] |= ~(np.diff(time) > 0)
    if not wrong.any():
        return
    index = int(np.argmax(wrong))
    what = "the time is missing"
    if math.isfinite(time[index]):
        what = f"the time {time[index]:.12g} s does not come after {time[index - 1]:.12g} s"
    raise KembaError(f"{where}:{index + 2}:1", what, "times must increase from row to row")


def _texts(values: Array) -> list[str]:
    """The shortest texts that read back as the same numbers."""
    switch = np.isin(values, (0.0, 1.0)).all() and not np.signbit(values).any()
    return [str(int(value)) if switch else repr(value) for value in values.tolist()]
