"""Foreign columns become ours, as a map says."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from kemba.errors import KembaError, suggest
from kemba.logs.columns import AddedColumn, ColumnMap, ColumnSource
from kemba.logs.text import Raw, as_numbers, first_row
from kemba.quantity import convert
from kemba.trajectory import TIME, Array, Trajectory

Column = np.ndarray[Any, Any]


def mapped(raw: Raw, layout: ColumnMap, path: Path, meta: dict[str, Any]) -> Trajectory:
    """The trajectory that a map makes of the columns of a file.

    Raises KembaError where a column is absent, a cell is no number or a unit does not fit.
    """
    reader = _Reader(raw, layout, path)
    time = reader.time()
    found = {}
    for header, source in layout.columns.items():
        if header == TIME:
            continue
        values = reader.values(header, source)
        if source.delay:
            values = _earlier(time, values, source.delay, hold="/valve/" in f"/{header}")
        found[header] = values
    return Trajectory(time, found, meta)


class _Reader:
    """Cells of one file as numbers."""

    def __init__(self, raw: Raw, layout: ColumnMap, path: Path) -> None:
        self.raw, self.layout, self.path = raw, layout, path

    def time(self) -> Array:
        """The time (n,) in s. Stamps are counted from the first before they become floats."""
        source = self.layout.columns[TIME]
        from_first = self.layout.origin == "first"
        stamps = self._column(TIME, source, _stamps if from_first else None)
        values = self._summed(TIME, source, stamps, from_first)
        return np.asarray(source.sign * source.scale * values + source.offset_in("s"))

    def values(self, header: str, source: ColumnSource) -> Array:
        """The column (n,) in our unit."""
        numbers = self._column(header, source)
        if source.threshold is not None:
            return np.where(np.isnan(numbers), np.nan, source.sign * (numbers - source.level()) > 0)
        values = self._summed(header, source, numbers)
        unit = header[header.index("[") + 1 : -1]
        return np.asarray(source.sign * source.scale * values + source.offset_in(unit))

    def _summed(
        self, header: str, source: ColumnSource, values: Column, from_first: bool = False
    ) -> Array:
        total = self._converted(header, source, _counted(values, from_first))
        if source.add is not None:
            part = self._column(header, source.add)
            total = total + self._converted(header, source.add, _counted(part, from_first))
        return total

    def _converted(self, header: str, source: ColumnSource | AddedColumn, values: Array) -> Array:
        unit = header[header.index("[") + 1 : -1]
        try:
            return convert(values, source.unit or unit, unit)
        except ValueError as error:
            what = f"map of '{header}': unit '{source.unit}' {error}"
            raise KembaError(str(self.path), what) from None

    def _column(
        self,
        header: str,
        source: ColumnSource | AddedColumn,
        other: Callable[[Column], Column | None] | None = None,
    ) -> Column:
        name = str(source.source)
        if name not in self.raw:
            what = f"has no column '{name}', which the map reads as '{header}'"
            raise KembaError(f"{self.path}:1", what, hint=suggest(name, list(self.raw)))
        if f"{name}#" in {other.rpartition("#")[0] + "#" for other in self.raw}:
            raise KembaError(f"{self.path}:1", f"has the column '{name}' more than once")
        cells = self.raw[name]
        if cells.dtype != object:
            return np.asarray(cells, dtype=float)
        found = other(cells) if other else None
        return self._numbers(cells, name) if found is None else found

    def _numbers(self, cells: Column, name: str) -> Array:
        numbers, wrong = as_numbers(cells, self.layout.decimal)
        if wrong.any():
            row = int(np.argmax(wrong))
            where = f"{self.path}:{row + first_row(self.layout)}:{list(self.raw).index(name) + 1}"
            hint = "`decimal`, `separator` and `skip_below` of the map" if wrong.all() else ""
            raise KembaError(where, f"{name}: '{cells[row]}' is not a number", hint=hint)
        return numbers


def _stamps(cells: Column) -> Column | None:
    """Whole numbers exactly, and dates in ns; None where the cells are neither."""
    import pandas as pd

    try:
        return np.array([int(cell) for cell in cells], dtype=object)
    except ValueError:
        pass
    if not any(mark in str(cells[0]) for mark in "-:T") or not len(cells):
        return None
    try:
        dates = pd.to_datetime(pd.Series(cells), format="ISO8601", utc=True)
    except (ValueError, TypeError):
        return None
    seconds = (dates - dates.iloc[0]).dt.total_seconds()
    return np.asarray(seconds, dtype=float)


def _counted(values: Column, from_first: bool) -> Array:
    first = values[0] if from_first and len(values) else 0
    return np.asarray(values - first, dtype=float)


def _earlier(time: Array, values: Array, delay: float, hold: bool) -> Array:
    """The column as it would be without its lag."""
    if hold:
        at = np.clip(np.searchsorted(time, time + delay, side="right") - 1, 0, len(time) - 1)
        return np.asarray(values[at])
    return np.interp(time + delay, time, values)
