"""Which column is the time; the layout of a ROS 2 JointState without a header."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from kemba.logs.draft import ranges
from kemba.logs.draft.words import meaning, named_unit
from kemba.logs.text import Raw, as_numbers
from kemba.settings import Settings, setting
from kemba.trajectory import Array

FIELDS = ("position", "velocity", "effort")


class StampSettings(Settings):
    """What a time column looks like."""

    rising: float = setting(
        0.99, "1", "share of steps that must rise", "convention: a few repeats are the gate's case"
    )


@dataclass(frozen=True)
class Stamp:
    """The time of a log: how the map reads it, from which columns."""

    source: dict[str, Any]
    names: tuple[str, ...]
    from_first: bool


def numbers(raw: Raw, decimal: str) -> dict[str, Array]:
    """The columns (n,) that hold numbers; texts are left out."""
    found = {}
    for name, cells in raw.items():
        values = as_numbers(cells, decimal)[0] if cells.dtype == object else cells.astype(float)
        if np.isfinite(values).mean() > 0.5:
            found[name] = values
    return found


def switches(raw: Raw) -> set[str]:
    """The columns that say `on` and `off`, or `true` and `false`."""
    words = {"on", "off", "true", "false"}
    texts = {name: cells for name, cells in raw.items() if cells.dtype == object}
    return {n for n, cells in texts.items() if {str(c).strip().lower() for c in cells} <= words}


def stamp_of(
    raw: Raw, values: Mapping[str, Array], below: Mapping[str, str] | None = None
) -> Stamp | None:
    """The time: a column (n,) that rises and whose name says so, else the first one that rises.

    `below`: units in a row below the header.
    """
    said = [name for name in values if "time" in _says(name)]
    parts = [name for name in values if "rest" in _says(name)]
    seconds = [name for name in said if name not in parts and _rises(values[name], strictly=False)]
    if seconds and parts:
        return _two_parts(seconds[0], parts[0])
    if list(raw)[:2] == ["1", "2"] and _is_split(values):
        return _two_parts("1", "2")
    rising = [name for name in values if _rises(values[name])]
    for name in [*(name for name in said if name in rising), *rising]:
        unit = named_unit(name)[1] or (below or {}).get(name) or ranges.time_unit(values[name])
        from_first = ranges.is_stamp(values[name], unit)
        source = {"source": name, **({} if unit == "s" else {"unit": unit})}
        return Stamp(source, (name,), from_first)
    return _date(raw)


def joint_state_labels(raw: Raw) -> dict[str, str]:
    """Names for the columns of `ros2 topic echo --csv` of a JointState: stamp, frame, the joints'
    names, then their positions, velocities and efforts. Empty where the columns are others."""
    constant = [n for n, cells in raw.items() if len(set(cells)) == 1 and _is_text(cells[0])]
    joints = [str(raw[name][0]) for name in constant if int(name) > 3]
    after = [name for name in raw if int(name) > 3 + len(joints)]
    if not joints or len(after) < len(joints):
        return {}
    return {
        column: f"{joints[i % len(joints)]}_{FIELDS[i // len(joints)]}"
        for i, column in enumerate(after[: len(FIELDS) * len(joints)])
    }


def _two_parts(seconds: str, rest: str) -> Stamp:
    source = {"source": seconds, "add": {"source": rest, "unit": "ns"}}
    return Stamp(source, (seconds, rest), True)


def _is_split(values: Mapping[str, Array]) -> bool:
    """Whether columns 1 and 2 are whole seconds since 1970 and nanoseconds."""
    if "1" not in values or "2" not in values:
        return False
    whole, rest = values["1"], values["2"]
    return bool(
        np.all(whole % 1 == 0) and whole[0] > ranges.STAMPED and 1e4 < rest.max(initial=0.0) < 1e9
    )


def _date(raw: Raw) -> Stamp | None:
    for name, cells in raw.items():
        if len(cells) and str(cells[0])[:2] in ("19", "20") and str(cells[0]).count(":") > 1:
            return Stamp({"source": name}, (name,), True)
    return None


def _says(name: str) -> set[str]:
    return set(meaning(named_unit(name)[0], ()))


def _is_text(cell: Any) -> bool:
    return any(letter.isalpha() for letter in str(cell))


def _rises(values: Array, strictly: bool = True) -> bool:
    steps = np.diff(values)
    rising = steps > 0 if strictly else steps >= 0
    return len(steps) > 0 and bool(np.mean(rising) > StampSettings.current().rising)
