"""Reading logs: own format or foreign columns through a map; robot or bench is read off them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from kemba.config import find_config, load_yaml, parse
from kemba.errors import KembaError, suggest
from kemba.identify.logs.settings import GateSettings
from kemba.identify.logs.sidecar import check_kind, check_noise
from kemba.mechanism import Mechanism
from kemba.quantity import Quantity, convert
from kemba.table import read_table
from kemba.trajectory import Array, Trajectory, sidecar

Kind = Literal["robot", "bench"]
BODY = ("body/x", "body/z", "body/pitch")
LEG = ("hip/q", "hip/tau", "piston/x", "valve/extend", "valve/retract")
BENCH = ("piston/x", "valve/extend", "valve/retract", "piston/F")
KINDS = ("robot", "bench")


class Source(BaseModel):
    """Where a column comes from: ours = sign * scale * source [unit in SI] + offset.

    `delay`: seconds by which the source column lags behind the others.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    source: str
    unit: str | None = None
    scale: float = 1.0
    sign: Literal[-1, 1] = 1
    offset: float = 0.0
    delay: float = 0.0


class ColumnMap(BaseModel):
    """A map file: our header (`piston/x [m]`, `time [s]`) -> the foreign column."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: Kind | None = None
    notes: str = ""
    columns: dict[str, Source] = Field(min_length=2)


def load_map(name: str | Path) -> ColumnMap:
    """The map YAML `name`, a path or one shipped in configs/logs. Raises KembaError."""
    path = find_config(str(name), "logs")
    found = parse(load_yaml(path), ColumnMap)
    if "time [s]" not in found.columns:
        raise KembaError(str(path), "columns: 'time [s]' is not mapped", "every log needs its time")
    for header in found.columns:
        if header != "time [s]":
            Quantity.from_header(header)
    return found


def read_log(path: str | Path, columns: ColumnMap | None = None) -> Trajectory:
    """One log, unchecked; `meta` has its kind and name. Raises KembaError with row and column."""
    path = Path(path)
    if path.is_dir():
        raise KembaError(str(path), "is a folder", "a CSV log was expected")
    log = Trajectory.read(path, strict=False) if columns is None else _foreign(path, columns)
    log.meta.setdefault("kind", (columns and columns.kind) or kind_of(log, path))
    log.meta["name"] = path.stem
    log.meta["path"] = str(path)
    beside = str(sidecar(path))
    log.meta["kind"] = check_kind(log.meta["kind"], KINDS, beside)
    if "noise" in log.meta:
        units = {name: log.unit(name) for name in log.names}
        log.meta["noise"] = check_noise(log.meta["noise"], units, beside)
    return _without_absurd(log)


def _without_absurd(log: Trajectory) -> Trajectory:
    """The log with readings that no channel can have as missing ones: their squares overflow."""
    limit = GateSettings.current().absurd
    columns = {h: log[name] for h, name in zip(log.headers, log.names, strict=True)}
    wild = {h: np.abs(values) > limit for h, values in columns.items()}
    broken = {h: np.where(wild[h], np.nan, columns[h]) for h in columns if wild[h].any()}
    return log.with_columns(broken) if broken else log


def read_logs(paths: Sequence[str | Path], columns: ColumnMap | None = None) -> list[Trajectory]:
    """Several logs of one kind, in the order of their names and not of the arguments.

    Raises KembaError for none, for unreadable ones and for robot and bench logs together.
    """
    if not paths:
        raise KembaError("", "no log given", "one or more CSV files were expected")
    unique = sorted({Path(p).resolve(): Path(p) for p in paths}.values(), key=_order)
    logs = [read_log(p, columns) for p in unique]
    kinds = {log.meta["kind"] for log in logs}
    if len(kinds) > 1:
        named = ", ".join(f"{log.meta['name']}: {log.meta['kind']}" for log in logs)
        raise KembaError("", "robot and bench logs cannot be fitted together", named)
    _tell_apart(logs)
    return logs


def _tell_apart(logs: Sequence[Trajectory]) -> None:
    """Logs of one name get their folder's name before it."""
    names = [log.meta["name"] for log in logs]
    for log in logs:
        if names.count(log.meta["name"]) > 1:
            path = Path(log.meta["path"]).resolve()
            log.meta["name"] = f"{path.parent.name}/{path.stem}"


def legs_of(log: Trajectory) -> tuple[str, ...]:
    """The legs of a robot's log: those of the machine that is known, else all whose columns the
    log has, whatever their names."""
    if "legs" in log.meta:
        return tuple(log.meta["legs"])
    parts = [name.split("/", 1) for name in log.names if "/" in name]
    return tuple(dict.fromkeys(leg for leg, rest in parts if leg != "body" and rest in LEG))


def needed(log: Trajectory) -> tuple[str, ...]:
    """The columns without which a log says nothing: they follow from its kind and its legs."""
    if log.meta["kind"] == "bench":
        return BENCH
    legs = legs_of(log) or ("<leg>",)
    return (*BODY, *(f"{leg}/{name}" for leg in legs for name in LEG))


def taken_on(logs: Iterable[Trajectory], mechanism: Mechanism) -> None:
    """Note in the logs on which machine they were taken: its legs and its stroke [m]."""
    for log in logs:
        log.meta["stroke"] = mechanism.stroke
        if log.meta["kind"] == "robot":
            log.meta["legs"] = list(mechanism.legs)


def kind_of(log: Trajectory, where: str | Path = "") -> Kind:
    """Robot or bench, by the columns. Raises KembaError for a log that is neither."""
    if any(name.startswith("body/") or "/hip/" in name for name in log.names):
        return "robot"
    if any(name in BENCH for name in log.names):
        return "bench"
    raise KembaError(
        f"{where}:1",
        "has neither the columns of a robot log nor those of a bench log",
        f"at least {', '.join(BENCH)} of a rig, or body/z and so on of a robot, were expected",
        "map foreign columns with --map",
    )


def _order(path: Path) -> tuple[str, str]:
    return path.name, str(path)


def _foreign(path: Path, columns: ColumnMap) -> Trajectory:
    headers, table = read_table(path, plain_headers=True)
    time_source = columns.columns["time [s]"]
    time = _values(path, headers, table, "time [s]", time_source)
    found = {}
    for header, source in columns.columns.items():
        if header == "time [s]":
            continue
        values = _values(path, headers, table, header, source)
        if source.delay:
            values = _earlier(time, values, source.delay, hold="/valve/" in f"/{header}")
        found[header] = values
    meta = load_yaml(sidecar(path)).data if sidecar(path).is_file() else {}
    return Trajectory(time, found, meta)


def _values(path: Path, headers: list[str], table: Array, header: str, source: Source) -> Array:
    if source.source not in headers:
        raise KembaError(
            f"{path}:1",
            f"has no column '{source.source}', which the map reads as '{header}'",
            hint=suggest(source.source, headers),
        )
    values: Array = table[:, headers.index(source.source)]
    unit = header[header.index("[") + 1 : -1]
    try:
        values = convert(values, source.unit or unit, unit)
    except ValueError as error:
        raise KembaError(str(path), f"map of '{header}': unit '{source.unit}' {error}") from None
    return np.asarray(source.sign * source.scale * values + source.offset)


def _earlier(time: Array, values: Array, delay: float, hold: bool) -> Array:
    """The column as it would be without its lag."""
    if hold:
        at = np.clip(np.searchsorted(time, time + delay, side="right") - 1, 0, len(time) - 1)
        return np.asarray(values[at])
    return np.interp(time + delay, time, values)
