"""Logs to be tried: a sound one with one to three kinds of damage, and damaged sidecars."""

from collections.abc import Callable
from typing import Any

import numpy as np
from hypothesis import strategies as st

from fuzz.values import NUMBERS, anything
from kemba.config.document import dump_text
from kemba.trajectory import Trajectory

Draw = Callable[[st.SearchStrategy[Any]], Any]
Rows = list[list[str]]  # the cells of a table, its header first
Damage = Callable[[Draw, Rows], Rows]


def cells(log: Trajectory) -> Rows:
    """A log as the cells of its table."""
    table = np.column_stack([log.time, *(log[name] for name in log.names)])
    return [["time [s]", *log.headers], *([f"{x:.9g}" for x in row] for row in table)]


def text(rows: Rows) -> str:
    """The CSV of a table's cells."""
    return "\n".join(",".join(row) for row in rows) + "\n"


def _column(draw: Draw, rows: Rows) -> int:
    return int(draw(st.integers(0, max(len(rows[0]) - 1, 0)))) if rows else 0


def _row(draw: Draw, rows: Rows) -> int:
    return int(draw(st.integers(1, max(len(rows) - 1, 1))))


def _mapped(rows: Rows, column: int, change: Callable[[float], float], first: int = 1) -> Rows:
    def cell(i: int, j: int, old: str) -> str:
        try:
            return repr(change(float(old))) if i >= first and j == column else old
        except (ValueError, OverflowError):
            return old

    return [[cell(i, j, old) for j, old in enumerate(row)] for i, row in enumerate(rows)]


def one_cell(draw: Draw, rows: Rows) -> Rows:
    """A cell that holds something else."""
    i, j = _row(draw, rows), _column(draw, rows)
    values = [
        *map(repr, NUMBERS),
        "",
        "nan",
        "inf",
        "-inf",
        "abc",
        "1e999",
        "0x1",
        "1_0",
        '"',
        "\x00",
    ]
    if i < len(rows) and j < len(rows[i]):
        rows[i][j] = draw(st.sampled_from(values))
    return rows


def column_scaled(draw: Draw, rows: Rows) -> Rows:
    """A column in another unit, from a row on."""
    factor = draw(st.sampled_from([-1.0, 0.0, 1e-3, 1e3, 1e5, 57.3, 1e30, 1.0001]))
    return _mapped(rows, _column(draw, rows), lambda x: factor * x, _row(draw, rows))


def column_shifted(draw: Draw, rows: Rows) -> Rows:
    """A column with another zero, from a row on."""
    offset = draw(st.sampled_from([-1e6, -1.57, -0.02, 1e-9, 0.02, 1.57, 100.0, 1e15]))
    return _mapped(rows, _column(draw, rows), lambda x: offset + x, _row(draw, rows))


def column_quantised(draw: Draw, rows: Rows) -> Rows:
    """A column in coarse steps."""
    step = draw(st.sampled_from([1e-4, 1e-2, 0.5, 8.0, 1e3]))
    return _mapped(rows, _column(draw, rows), lambda x: step * round(x / step))


def column_empty(draw: Draw, rows: Rows) -> Rows:
    """A column without readings, from a row on."""
    j, first = _column(draw, rows), _row(draw, rows)
    return [[c if i < first or k != j else "" for k, c in enumerate(r)] for i, r in enumerate(rows)]


def column_removed(draw: Draw, rows: Rows) -> Rows:
    """A table without one of its columns."""
    j = _column(draw, rows)
    return [[c for k, c in enumerate(row) if k != j] for row in rows]


def columns_swapped(draw: Draw, rows: Rows) -> Rows:
    """Two columns under each other's header."""
    i, j = _column(draw, rows), _column(draw, rows)
    for row in rows[1:]:
        if max(i, j) < len(row):
            row[i], row[j] = row[j], row[i]
    return rows


def header_changed(draw: Draw, rows: Rows) -> Rows:
    """A header that is another one, a repeated one, or none."""
    names = [
        "",
        "x",
        "x [m]",
        "time [s]",
        "piston/F [kN]",
        "piston/x [m]",
        "a/b/c [1]",
        "[m]",
        "=1",
    ]
    if rows and rows[0]:
        rows[0][min(_column(draw, rows), len(rows[0]) - 1)] = draw(st.sampled_from(names))
    return rows


def rows_cut(draw: Draw, rows: Rows) -> Rows:
    """A part of the log only."""
    i = _row(draw, rows)
    return draw(st.sampled_from([rows[: i + 1], rows[:1] + rows[i:], rows[:1] + rows[1::i]]))


def rows_repeated(draw: Draw, rows: Rows) -> Rows:
    """Rows that come again, or in another order."""
    i = _row(draw, rows)
    again = [rows[:i] + rows[i - 1 :], rows + rows[1:], rows[:1] + rows[:0:-1]]
    return [list(row) for row in draw(st.sampled_from(again))]


def ragged(draw: Draw, rows: Rows) -> Rows:
    """A row with a cell too many or too few."""
    i = _row(draw, rows)
    if i < len(rows):
        rows[i] = draw(st.sampled_from([rows[i][:-1], [*rows[i], "1"], [], [""]]))
    return rows


DAMAGES: tuple[Damage, ...] = (
    one_cell, column_scaled, column_shifted, column_quantised, column_empty, column_removed,
    columns_swapped, header_changed, rows_cut, rows_repeated, ragged,
)  # fmt: skip


@st.composite
def damaged_log(draw: Draw, rows: Rows) -> str:
    """The text of a log with one to three kinds of damage."""
    found = [list(row) for row in rows]
    for damage in draw(st.lists(st.sampled_from(DAMAGES), min_size=1, max_size=3)):
        found = damage(draw, found)
    return text(found)


@st.composite
def sidecar(draw: Draw, headers: tuple[str, ...]) -> str:
    """The text of a sidecar: kind and noise, right or not."""
    values = st.one_of(anything, st.sampled_from([0.5, "0.3 mm", "1 N", 1e-9, 1e9]))
    channels = st.sampled_from([*headers, *(h.split(" [")[0] for h in headers), "x", ""])
    data: dict[str, Any] = {"kind": draw(st.one_of(st.sampled_from(["bench", "robot"]), anything))}
    data["noise"] = draw(st.one_of(st.dictionaries(channels, values, max_size=4), anything))
    if draw(st.booleans()):
        data[draw(st.sampled_from(["name", "path", "legs", "stroke", "notes"]))] = draw(anything)
    return dump_text(draw(st.sampled_from([data, data, data["noise"]])))
