"""CSV tables of numbers: the fast reader, and the slow search for the faulty cell."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterable, Iterator
from itertools import chain
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from kemba.errors import KembaError, map_hint
from kemba.quantity import Quantity, is_si

Table = np.ndarray[Any, np.dtype[np.float64]]


def read_table(path: str | Path) -> tuple[list[str], Table]:
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
        raise KembaError(
            f"{path}:1",
            "is separated by semicolons",
            "commas, and decimal points, were expected",
            map_hint(path),
        )
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


def _numbers(stream: TextIO, width: int) -> Table:
    """The rows below the header (n, width); ValueError when one is faulty."""
    rows = _filled(stream, width)
    first = next(rows, None)
    if first is None:
        return np.empty((0, width))
    table = np.loadtxt(
        chain([first], rows), delimiter=",", ndmin=2, comments=None, quotechar='"', dtype=float
    )
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
