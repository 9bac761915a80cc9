"""Long ("tidy") tables, one row for each time, channel and value, as columns."""

import re
from dataclasses import replace

import numpy as np

from kemba.errors import KembaError
from kemba.logs import times
from kemba.logs.recording import TIME_WORD, Column, Raw, Recording, free
from kemba.logs.text import as_numbers
from kemba.trajectory import Array

MOST = 300  # channels of one table
FEWEST = 3  # rows of a channel
RISING = 0.99  # share of the steps of a channel in which its time rises
VALUES = frozenset("value _value values val wert messwert valeur".split())
UNITS = frozenset("unit units einheit uom".split())
# numbers of rows, and what InfluxDB says of its answers: of no channel
LABEL = re.compile(r"\d*|index|Unnamed: 0|__index_level_0__|result|table|_start|_stop")


def spread(found: Recording, decimal: str, where: str) -> Recording:
    """The recording with a column for each channel of a long table, each with its own clock; any
    other recording is returned as it is.

    A table is long where one of its columns holds the readings, one a time that rises in each of
    the channels that texts in others tell apart. Raises KembaError where a reading is no number.
    """
    if found.clocks or len({len(cells) for cells in found.columns.values()}) != 1:
        return found
    if not any(_is_text(cells) for cells in found.columns.values()):
        return found
    columns = {n: c for n, c in found.columns.items() if not LABEL.fullmatch(n) and _differs(c)}
    texts = {n: c for n, c in columns.items() if _is_text(c)}
    clock = next((name for name in columns if TIME_WORD.search(name.lower().strip("_"))), "")
    names = [n for n in texts if n not in (clock, *VALUES) and n.lower() not in (*VALUES, *UNITS)]
    names = [name for name in names if len(set(texts[name])) <= MOST]
    rest = [name for name in columns if name not in (clock, *names) and name.lower() not in UNITS]
    if not clock or not names or len(rest) != 1:
        return found
    parts = [texts[name] for name in names]
    labels = np.array(["/".join(map(str, row)) for row in zip(*parts, strict=True)])
    time = _time(columns[clock])
    channels = {label: np.flatnonzero(labels == label) for label in dict.fromkeys(labels.tolist())}
    if time is None or not 2 <= len(channels) <= MOST:
        return found
    steps = [np.diff(time[rows]) for rows in channels.values()]
    if min(map(len, channels.values())) < FEWEST or any(np.mean(s > 0) < RISING for s in steps):
        return found
    values = _values(columns[rest[0]], labels, rest[0], decimal, where)
    return _columns(found, clock, time, channels, values)


def _is_text(cells: Column) -> bool:
    return cells.dtype == object and len(cells) > 0 and isinstance(cells[0], str)


def _differs(cells: Column) -> bool:
    """Whether not all readings are the same."""
    known = cells[cells == cells]
    return len(known) > 0 and bool((known != known[0]).any())


def _time(cells: Column) -> Column | None:
    """The times (n,) as numbers, whole ones as they are; of texts in s."""
    return times.seconds(cells) if cells.dtype == object else cells


def _values(cells: Column, labels: Column, name: str, decimal: str, where: str) -> Array:
    if cells.dtype != object:
        return cells.astype(float)
    values, wrong = as_numbers(cells, decimal)
    if wrong.any():
        row = int(np.argmax(wrong))
        what = f"{name} of {labels[row]}: '{cells[row]}' is not a number"
        raise KembaError(where, what, hint="leave such rows out where they mean no reading")
    return values


def _columns(
    found: Recording, clock: str, time: Column, channels: dict[str, Column], values: Array
) -> Recording:
    """The channels, those of equal times with one clock."""
    stated = next((c for n, c in found.columns.items() if n.lower() in UNITS), None)
    columns: Raw = {}
    clocks: dict[str, str] = {}
    units: dict[str, str] = {}
    for label, rows in sorted(channels.items(), key=lambda item: -len(item[1])):
        known = set(clocks.values())
        own = next((n for n in known if np.array_equal(columns[n], time[rows])), None)
        if own is None:
            own = free(f"{label}/{clock}" if columns else clock, columns)
            columns[own] = time[rows]
            if unit := found.units.get(clock, "s" if found.columns[clock].dtype == object else ""):
                units[own] = unit
        columns[label] = values[rows]
        clocks[label] = own
        if stated is not None and isinstance(unit := stated[rows[0]], str) and unit:
            units[label] = unit
    several = len(set(clocks.values())) > 1
    said = f"a long table: {len(channels)} channels, one row for each of their readings"
    return replace(
        found,
        columns=columns,
        clocks=clocks if several else {},
        units=units,
        remarks=(*found.remarks, said),
    )
