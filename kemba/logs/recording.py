"""What a file of another program holds, before a map says which column is which."""

import re
from collections.abc import Collection, Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

Column = np.ndarray[Any, Any]
Raw = dict[str, Column]
TIME_WORD = re.compile(
    r"(?:^|[^a-z])(?:t|time|timestamp|stamp|zeit|tout)(?:$|[^a-z])", re.IGNORECASE
)

CLOCK = "time"  # of the longest group
OTHER_CLOCK = "log_time"  # of the others, or where a column has that name


@dataclass(frozen=True)
class Recording:
    """Columns (n,) by name. `clocks`: for a column with a clock of its own, the column that holds
    it; without any, all columns are as long. `units` that the file states, and the one of all
    `angles`; `remarks` about what was left out."""

    columns: Raw
    meta: Mapping[str, Any] = field(default_factory=dict)
    clocks: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    angles: str = ""


@dataclass(frozen=True)
class Group:
    """Columns (n,) that were read at the same `time` (n,): a topic, a task, a message."""

    name: str
    time: Column
    time_unit: str
    columns: Raw
    units: dict[str, str] = field(default_factory=dict)


def recording(groups: Sequence[Group], remarks: Iterable[str] = ()) -> Recording:
    """One recording of several groups; of one alone, the names are those of its columns."""
    columns: Raw = {}
    clocks: dict[str, str] = {}
    units: dict[str, str] = {}
    ordered = sorted(groups, key=lambda group: -len(group.time))
    for i, group in enumerate(ordered):
        path = f"{group.name}/" if group.name and (len(groups) > 1 or "/" in group.name) else ""
        own = {path + name: free(path + name, columns) for name in group.columns}
        first = not i and CLOCK not in own
        clock = CLOCK if first else free(f"{path}{OTHER_CLOCK}", [*columns, *own.values()])
        columns[clock], units[clock] = group.time, group.time_unit
        columns |= {own[path + name]: values for name, values in group.columns.items()}
        clocks |= dict.fromkeys(own.values(), clock)
        units |= {own[path + name]: unit for name, unit in group.units.items()}
    return Recording(columns, {}, clocks if len(groups) > 1 else {}, units, tuple(remarks))


def free(name: str, taken: Container[str]) -> str:
    """The name, with a number where there is one like it already."""
    return next(n for i in range(1, 10**6) if (n := f"{name}#{i}" if i > 1 else name) not in taken)


def shared(groups: Iterable[Group]) -> list[Group]:
    """The groups, those of the very same times as one."""
    found: list[Group] = []
    for group in groups:
        path = f"{group.name}/" if group.name else ""
        columns = {path + name: values for name, values in group.columns.items()}
        units = {path + name: unit for name, unit in group.units.items()}
        same = (g for g in found if g.time_unit == group.time_unit)
        other = next((g for g in same if np.array_equal(g.time, group.time)), None)
        if other is None:
            found.append(Group("", group.time, group.time_unit, columns, units))
        else:
            own = {name: free(name, other.columns) for name in columns}
            other.columns.update({own[name]: values for name, values in columns.items()})
            other.units.update({own[name]: unit for name, unit in units.items()})
    return found


def some(names: Collection[str], most: int = 6) -> str:
    """The first of many names, and how many more there are."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return f"{', '.join(list(names)[:most])}{more}"


def by_length(vectors: Mapping[str, Column]) -> Recording:
    """Loose vectors: those of the length that most have, and those of another one that a rising
    vector called a time has too."""
    lengths = [len(values) for values in vectors.values()]
    main = max(set(lengths), key=lambda n: (lengths.count(n), n))
    columns, clocks, left = {}, {}, list[str]()
    base = _clock_of(vectors, main)
    for name, values in vectors.items():
        own = base if len(values) == main else _clock_of(vectors, len(values))
        if len(values) != main and own is None:
            left.append(name)
            continue
        columns[name] = values
        if base is not None and own is not None and own != name:
            clocks[name] = own
    several = len(set(clocks.values())) > 1
    said = (f"left out, since no vector of their length is a time: {some(left)}",) if left else ()
    return Recording(columns, clocks=clocks if several else {}, remarks=said)


def _clock_of(vectors: Mapping[str, Column], length: int) -> str | None:
    clocks = (n for n, values in vectors.items() if len(values) == length and is_clock(n, values))
    return next(clocks, None)


def is_clock(name: str, values: Column) -> bool:
    """Whether a vector (n,) is called a time and rises."""
    numbers = values.ndim == 1 and len(values) > 2 and values.dtype.kind in "fiu"
    return bool(numbers and TIME_WORD.search(name) and np.all(np.diff(values) > 0))
