"""How a text table is written: separator, decimal sign, header. Found by trying all of them."""

from __future__ import annotations

import csv
import re
from itertools import islice
from pathlib import Path
from typing import Any

from kemba.errors import KembaError
from kemba.logs.text import encoding

LINES = 300  # as many are looked at; a table that changes later is told when it is read
SEPARATORS = (";", "tab", ",", "|", "whitespace")
WAYS = [(mark, sign) for mark in SEPARATORS for sign in (".", ",") if mark != sign]
SIGNS = {"tab": "\t"}
NUMBER = {
    ".": re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?"),
    ",": re.compile(r"[+-]?(\d+,?\d*|,\d+)([eE][+-]?\d+)?"),
}
Layout = dict[str, Any]


def layout_of(path: Path) -> Layout:
    """Keys of a column map that say how to read the table; those with their default are left out.

    Of all separators and decimal signs, the one that gives most numbers. Raises KembaError where
    none gives a table of at least two columns.
    """
    lines = _lines(path)
    found = [(_numbers(lines, *way), way) for way in WAYS]
    (score, begin, width), (separator, decimal) = max(found, key=lambda pair: pair[0][0])
    if not score or width < 2:
        expected = "rows of at least two numbers were expected"
        raise KembaError(str(path), "is no table that kemba recognises", expected)
    header = _header(lines[:begin], separator, width)
    layout: Layout = {} if separator == "," else {"separator": separator}
    layout |= {} if decimal == "." else {"decimal": decimal}
    above = begin if header is None else header
    below = 0 if header is None else sum(bool(line.strip()) for line in lines[header + 1 : begin])
    layout |= {"skip_rows": above} if above else {}
    layout |= {"skip_below": below} if below else {}
    return layout | ({"header": False} if header is None else {})


def units_below(path: Path, layout: Layout) -> list[str]:
    """The cells of the row below the header, if it is no data: often the columns' units."""
    if not layout.get("skip_below"):
        return []
    below = _lines(path)[layout.get("skip_rows", 0) + 1 :]
    first = next((line for line in below if line.strip()), "")
    return [cell.strip("[]() ") for cell in _cells(first, layout.get("separator", ","))]


def _lines(path: Path) -> list[str]:
    try:
        with open(path, encoding=encoding(path), newline=None) as stream:
            return [line.rstrip("\n") for line in islice(stream, LINES)]
    except OSError as error:
        raise KembaError(str(path), error.strerror or str(error)) from None


def _cells(line: str, separator: str) -> list[str]:
    if separator == "whitespace":
        return line.split()
    return [c.strip() for c in next(csv.reader([line], delimiter=SIGNS.get(separator, separator)))]


def _numbers(lines: list[str], separator: str, decimal: str) -> tuple[int, int, int]:
    """How many numbers the rows of the table hold, its first line, and its columns."""
    rows = [(number, _cells(line, separator)) for number, line in enumerate(lines) if line.strip()]
    if not rows:
        return 0, 0, 0
    width = len(rows[-1][1])
    counts: list[tuple[int, int]] = []
    for number, cells in reversed(rows):
        numeric = sum(bool(NUMBER[decimal].fullmatch(cell)) for cell in cells)
        if len(cells) != width or numeric < 2:
            break
        counts.append((numeric, number))
    return sum(n for n, _ in counts), counts[-1][1] if counts else 0, width


def _header(above: list[str], separator: str, width: int) -> int | None:
    """The line that names the columns: the first above the numbers that is as wide."""
    wide = [i for i, line in enumerate(above) if len(_cells(line, separator)) == width]
    return wide[0] if wide else None
