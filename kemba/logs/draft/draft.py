"""Draft a column map for a log of another program, from names, units and ranges."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kemba.errors import KembaError
from kemba.logs.columns import ColumnMap
from kemba.logs.draft import ranges
from kemba.logs.draft.layout import Layout, layout_of, units_below
from kemba.logs.draft.matching import assigned
from kemba.logs.draft.stamps import Stamp, joint_state_labels, numbers, stamp_of, switches
from kemba.logs.draft.targets import Target, bench_targets, drive_targets, robot_targets
from kemba.logs.draft.words import SPELT, Names
from kemba.logs.opening import TEXTS, raw_columns
from kemba.trajectory import TIME, Array
from kemba.units import is_unit


@dataclass(frozen=True)
class Draft:
    """A drafted map: its `layout`, its `columns`, and what is `missing` or `ignored`."""

    kind: str
    layout: Layout
    columns: dict[str, dict[str, Any]]
    missing: tuple[str, ...]
    ignored: tuple[str, ...]

    def text(self, name: str) -> str:
        """The map as YAML, with what is missing as comments."""
        head = {"kind": self.kind, **self.layout}
        lines = [f"# Column map for {name}, drafted from its names, units and values: check it."]
        lines += ["# Signs, and where an angle is zero, cannot be seen in a table.", ""]
        lines += [f"{key}: {json.dumps(value)}" for key, value in head.items()]
        lines += ["columns:"]
        for header, source in self.columns.items():
            inner = ", ".join(f"{k}: {_flow(v)}" for k, v in source.items())
            lines.append(f"  {header}: {{{inner}}}")
        lines += [f"  # {header}: {{source: ...}}  # needed, not found" for header in self.missing]
        if self.ignored:
            lines += ["", f"# Ignored: {', '.join(self.ignored)}"]
        return "\n".join(lines) + "\n"


def draft_map(path: Path, legs: Sequence[str]) -> Draft:
    """A map for the log `path` of a machine with these legs. Raises KembaError where the file is
    no table or has no time."""
    layout = layout_of(path) if path.suffix.lower() in TEXTS else {}
    trial = ColumnMap.model_construct(**layout)
    raw, _ = raw_columns(path, trial)
    labels = {} if trial.header else joint_state_labels(raw)
    names = Names(legs, labels, _units_below(path, layout, list(raw)), switches(raw))
    values = numbers(raw, trial.decimal)
    stamp = stamp_of(raw, values, names.below)
    if stamp is None:
        raise KembaError(str(path), "no column rises from row to row", "a time was expected")
    rest = {name: v for name, v in values.items() if name not in stamp.names}
    kind, targets = _kind(names, rest)
    pairs = assigned(names, rest, targets)
    columns = {TIME: stamp.source}
    guessed = _guessed_units(names, pairs, rest)
    for target in targets:
        if target.header in pairs:
            name = pairs[target.header]
            unit = names.unit(name) or guessed.get(ranges.alike(target.header))
            columns[target.header] = _source(target, name, unit, rest[name])
    _share_level(columns, pairs, rest)
    used = {*pairs.values(), *stamp.names}
    missing = tuple(t.header for t in targets if t.needed and t.header not in pairs)
    return Draft(
        kind, layout | _origin(stamp), columns, missing, tuple(n for n in raw if n not in used)
    )


def _units_below(path: Path, layout: Layout, names: Sequence[str]) -> dict[str, str]:
    """The units in the row below the header; texts that are no units are left out."""
    found = {}
    for name, text in zip(names, units_below(path, layout), strict=False):
        unit = SPELT.get(text, text)
        if is_unit(unit):
            found[name] = unit
    return found


def _guessed_units(
    names: Names, pairs: Mapping[str, str], values: Mapping[str, Array]
) -> dict[str, str]:
    """The units of columns that are alike, where nothing tells them: those of the others in the
    log, else by the size of all together, since a jump on the spot has small `x` and pitch."""
    found: dict[str, str] = {}
    for group in {ranges.alike(header) for header in pairs}:
        own = {h: n for h, n in pairs.items() if ranges.alike(h) == group and "valve/" not in h}
        told = {names.unit(name) for name in own.values()} - {None}
        size = np.concatenate([values[name] for name in own.values()] or [np.zeros(0)])
        unit = told.pop() if len(told) == 1 else ranges.guessed_unit(next(iter(own), "[1]"), size)
        if unit is not None:
            found[group] = unit
    return found


def _share_level(
    columns: dict[str, dict[str, Any]], pairs: Mapping[str, str], values: Mapping[str, Array]
) -> None:
    """A valve that never switches in this log has the threshold of the others."""
    level = next((s["threshold"] for s in columns.values() if "threshold" in s), None)
    for header, name in pairs.items():
        if "valve/" in header and level is not None and np.ptp(values[name]) == 0:
            columns[header]["threshold"] = level


def _origin(stamp: Stamp) -> Layout:
    return {"origin": "first"} if stamp.from_first else {}


def _kind(names: Names, values: Mapping[str, Array]) -> tuple[str, list[Target]]:
    """What machine the columns are of, and the columns that such a log may have."""

    def says(group: str, *words: str) -> bool:
        return any(names.says(name).get(group, set()) & set(words) for name in values)

    if says("part", "hip", "body", "foot") or says("direction", "pitch"):
        return "robot", robot_targets(names.legs)
    if says("part", "valve"):
        return "bench", bench_targets()
    if says("kind", "pressure"):
        return "cylinder", [_optional(target) for target in bench_targets()]
    return "drive", drive_targets(rotary=says("kind", "torque"))


def _optional(target: Target) -> Target:
    return Target(target.header, target.means, target.may, target.needed and not target.is_valve)


def _source(target: Target, name: str, unit: str | None, values: Array) -> dict[str, Any]:
    source: dict[str, Any] = {"source": name}
    if target.is_valve:
        level = ranges.valve_level(values)
        return source if level is None else {**source, "threshold": level}
    if unit and unit != target.unit:
        source["unit"] = unit
    return source | (ranges.gauge(values, unit) if target.unit == "Pa" else {})


def _flow(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{k}: {_flow(v)}" for k, v in value.items()) + "}"
    return json.dumps(value, ensure_ascii=False)
