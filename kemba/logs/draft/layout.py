"""How a text table is written: separator, decimal sign, header. Found by trying all of them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from typing import Any

from kemba.errors import KembaError
from kemba.logs.text import cells_of, encoding, joined

LINES = 300  # as many are looked at; a table that changes later is told when it is read
NEARLY = 0.8  # share of the most numbers that a way to read a table must give
SEPARATORS = (";", "tab", ",", "|", "whitespace")
WAYS = [(mark, sign) for mark in SEPARATORS for sign in (".", ",") if mark != sign]
NUMBER = {
    ".": re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?"),
    ",": re.compile(r"[+-]?(\d+,?\d*|,\d+)([eE][+-]?\d+)?"),
}
Layout = dict[str, Any]


def layout_of(path: Path) -> Layout:
    """Keys of a column map that say how to read the table; those with their default are left out.

    Of all separators and decimal signs that give about the most numbers, one that gives a name to
    each column too, and then the one that gives most. Raises KembaError where none gives a table of
    at least two columns.
    """
    lines = _lines(path)
    found = [(_numbers(lines, *way), way) for way in WAYS]
    most = max(score for (score, _, _), _ in found)
    (score, begin, width), (separator, decimal) = max(
        (way for way in found if way[0][0] >= NEARLY * most),
        key=lambda way: (_header(lines[: way[0][1]], way[1][0], way[0][2])[1] > 0, way[0][0]),
    )
    if not score or width < 2:
        expected = "rows of at least two numbers were expected"
        raise KembaError(str(path), "is no table that kemba recognises", expected)
    header, rows = _header(lines[:begin], separator, width)
    layout: Layout = {} if separator == "," else {"separator": separator}
    layout |= {} if decimal == "." else {"decimal": decimal}
    above = header if rows else begin
    below = sum(bool(line.strip()) for line in lines[header + rows : begin]) if rows else 0
    layout |= {"skip_rows": above} if above else {}
    layout |= {"skip_below": below} if below else {}
    return layout | ({} if rows == 1 else {"header": rows or False})


def units_below(path: Path, layout: Layout) -> list[str]:
    """The cells of the row below the header, if it is no data: often the columns' units."""
    if not layout.get("skip_below"):
        return []
    below = _lines(path)[layout.get("skip_rows", 0) + int(layout.get("header", 1)) :]
    first = next((line for line in below if line.strip()), "")
    return [cell.strip("[]() ") for cell in cells_of(first, layout.get("separator", ","))]


def _lines(path: Path) -> list[str]:
    try:
        with open(path, encoding=encoding(path), newline=None, errors="replace") as stream:
            return [line.rstrip("\n") for line in islice(stream, LINES)]
    except OSError as error:
        raise KembaError(str(path), error.strerror or str(error)) from None


def _numbers(lines: list[str], separator: str, decimal: str) -> tuple[int, int, int]:
    """How many numbers the rows of the table hold, its first line, and its columns."""
    rows = []
    for number, line in enumerate(lines):
        if line.strip():
            cells = cells_of(line, separator)
            rows.append((number, len(cells), _count(cells, decimal)))
    numeric = [(number, width, count) for number, width, count in rows if count >= 2]
    if not numeric:
        return 0, 0, 0
    width = Counter(width for _, width, _ in numeric).most_common(1)[0][0]
    table = [(number, count) for number, other, count in numeric if other == width]
    return sum(count for _, count in table), table[0][0], width


def _count(cells: Sequence[str], decimal: str) -> int:
    return sum(bool(NUMBER[decimal].fullmatch(cell)) for cell in cells)


def _header(above: list[str], separator: str, width: int) -> tuple[int, int]:
    """The line that names the columns, and how many rows it has; 0 of a table without header.

    Of the lines above the numbers that are as wide: the one of most different names, the first of
    equal ones; with the lines above it where names repeat and these tell them apart.
    """
    rows = {i: cells_of(line, separator) for i, line in enumerate(above) if line.strip()}
    wide = [i for i, cells in rows.items() if _wide(cells, width)]
    if not wide:
        return 0, 0
    best = max(wide, key=lambda i: (_different(rows[i]), -i))
    for first in reversed([i for i in wide if i < best]):
        together = joined([rows[i] for i in wide if first <= i <= best])
        if _different(together) > _different(rows[best]) and best - first < len(wide):
            return first, best - first + 1
    return best, 1


def _wide(cells: Sequence[str], width: int) -> bool:
    """Whether a line has a name for each column; the last may end in an empty cell."""
    return len(cells) == width or (len(cells) == width - 1 and all(cells))


def _different(cells: Sequence[str]) -> int:
    return len({cell for cell in cells if cell})
