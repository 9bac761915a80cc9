"""Reading logs: own format or foreign columns through a map; robot or bench is read off them.

Long logs are shortened: rows about 1 ms apart, and one minute of pieces spread over the log.
"""

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from kemba.errors import KembaError, map_hint, suggest
from kemba.logs import Columns, map_of, open_log
from kemba.logs.foreign import unwrapped, wraps
from kemba.logs.times import one_clock
from kemba.mechanism import Mechanism
from kemba.quantity import Quantity, convert, to_si
from kemba.trajectory import Array, Trajectory, sidecar


class GateSettings:
    """When a log is refused."""

    shortest = 0.05  # a log must last at least so long [s]: a fast stroke lasts 0.08
    fewest = 60  # a log must have at least so many rows
    # largest median distance of rows [s]: 50 rows a second; chambers of Table I need 8 to 37 ms to
    # fill
    slowest = 0.02
    # median distance of rows that suggests a time in ms [s]: nobody logs at 2 Hz, 1 kHz is usual
    milliseconds = 0.5
    gaps = 0.5  # mean distance of rows that means long gaps [s]
    missing = 0.3  # share of readings of a needed column that may be missing
    impossible = 0.002  # share of impossible readings that a needed column may have
    impossible_elsewhere = 0.05  # the same for columns that are not needed
    # a valve column may be off 0 or 1 by this: a scaled voltage is off by a few per mille to a few
    # per cent
    valve = 0.02
    # readings beyond this, in the channel's SI unit, count as missing: a broken record, not a
    # measured value; its square would overflow
    absurd = 1e12
    quiet = 1e-4  # noise over range below which a channel counts as noiseless
    frozen = 40  # equal readings in a row that mean a dead sensor
    repeats = 0.2  # share of equal neighbours elsewhere that means a coarse sensor
    fastest = 8.0  # no piston moves faster [m.s-1]
    leap = 0.004  # a position may be off by this between two rows [m]
    calm = 0.3  # a leap stands beside steps of less than this share of the largest
    moves = 2e-3  # a position with less travel does not move [m]
    beyond = 0.015  # a position may read so far past the stroke [m]
    dead = 200  # rows without any change that mean a dead sensor


# Physical limits by the last part of the name: smallest, largest, and the likely mistake.
RANGES = {
    "piston/x": (
        -0.01,
        1.0,
        "metres from 0 (retracted) to the stroke; is it in millimetres, counted backwards, or a "
        "share of the stroke (`unit: 70 mm` in a map, of a stroke of 70 mm)?",
    ),
    "piston/v": (-8.0, 8.0, "metres per second; is it in mm/s?"),
    "piston/F": (-3000.0, 3000.0, "newtons, pushing positive"),
    "hip/q": (-2 * math.pi, 2 * math.pi, "radians; is it in degrees?"),
    "hip/tau": (-60.0, 60.0, "newton metres at the joint; is it in N.mm?"),
    "body/pitch": (-3 * math.pi, 3 * math.pi, "radians, nose up positive; is it in degrees?"),
    "body/x": (-20.0, 20.0, "metres; is it in millimetres?"),
    "body/z": (
        -0.1,
        3.0,
        "metres above the ground; is it in millimetres, counted downwards, or swapped with body/x?",
    ),
    "body/vx": (-20.0, 20.0, "metres per second"),
    "body/vz": (-20.0, 20.0, "metres per second"),
    "body/ax": (-2000.0, 2000.0, "metres per second squared"),
    "body/az": (-2000.0, 2000.0, "metres per second squared"),
    "P": (2e4, 2e6, "pascals, absolute; is it in bar or kPa, or gauge?"),
}


def range_of(name: str) -> tuple[float, float, str] | None:
    """Smallest and largest reading of a column, and the likely mistake; None where unknown."""
    return next((v for k, v in RANGES.items() if name == k or name.endswith(f"/{k}")), None)


def _check_kind(kind: Any, kinds: Collection[str], where: str) -> str:
    """The kind of a log. Raises KembaError where it is none of `kinds`."""
    if isinstance(kind, str) and kind in kinds:
        return kind
    named = " or ".join(f"'kind: {k}'" for k in kinds)
    near = suggest(kind, kinds) if isinstance(kind, str) else ""
    hint = near if near.startswith("did you") else ""  # they are all named already
    raise KembaError(f"{where}: kind", f"'{kind}' is no kind of log", f"{named} was expected", hint)


def _check_noise(
    noise: Any, units: Mapping[str, str], where: str
) -> tuple[dict[str, float], dict[str, float]]:
    """Noise [SI] by channel, correlation time [s] where given. Raises KembaError."""
    if noise is None:
        return {}, {}
    if not isinstance(noise, Mapping):
        expected = "one line per channel was expected, such as 'piston/F [N]: 0.5'"
        raise KembaError(f"{where}: noise", f"'{noise}' names no channel", expected)
    found, times = {}, {}
    for key, value in noise.items():
        name = str(key).split(" [")[0]
        if name not in units:
            continue
        place, unit = f"{where}: noise: {key}", units[name]
        written = Quantity.from_header(str(key)).unit if "[" in str(key) else unit
        if isinstance(value, Mapping):
            value, times[name] = _group(value, place)
        sigma = _positive(value, written, unit, place, f"the column is '{name} [{unit}]'")
        found[name] = sigma
    return found, times


def _group(value: Mapping[str, Any], place: str) -> tuple[Any, float]:
    """Sigma as written, and correlation time [s], of a group."""
    if set(value) != {"sigma", "time"}:
        keys = ", ".join(map(str, value)) or "nothing"
        expected = "'{sigma: 0.3 mm, time: 10 ms}' was expected"
        raise KembaError(place, f"the group has {keys}", expected)
    return value["sigma"], _positive(value["time"], "s", "s", f"{place}: time")


def _positive(value: Any, written: str, unit: str, place: str, hint: str = "") -> float:
    """A number above 0 in `unit`, `written` in another one; `hint` where it is of another kind."""
    try:
        number = convert(to_si(value, written), written, unit)
    except ValueError as error:
        raise KembaError(place, str(error), hint=hint) from None
    if not number > 0.0:
        what = f"the value is {value}; no sensor is without noise"
        hint = "leave the line out: the noise is then learnt from the log"
        raise KembaError(place, what, f"a number above 0 in {unit} was expected", hint)
    return float(number)


Kind = Literal["robot", "bench", "cylinder", "drive", "vessel"]
BODY = ("body/x", "body/z", "body/pitch")
LEG = ("hip/q", "hip/tau", "piston/x", "valve/extend", "valve/retract")
BENCH = ("piston/x", "valve/extend", "valve/retract", "piston/F")
KINDS = ("robot", "bench", "cylinder", "drive", "vessel")
OWN_RIGS = ("cylinder", "drive", "vessel")


def read_log(path: str | Path, columns: Columns = None) -> Trajectory:
    """One log, unchecked; `meta` has its kind and name. Raises KembaError with row and column."""
    path, columns = Path(path), map_of(columns)
    log = _turned(one_clock(open_log(path, columns, strict=False)))
    log.meta.setdefault("kind", (columns and columns.kind) or kind_of(log, path))
    if log.meta["kind"] == "plan":
        here = (path.parent / "manifest.json").is_file()
        run = path.parent if here else log.meta.get("run", "RUN")
        hint = f"logs of it come from the robot, or from: kemba-opt simulate {run}"
        raise KembaError(str(path), "is a plan, not a log", hint=hint)
    log.meta["name"] = path.stem
    log.meta["path"] = str(path)
    beside = str(sidecar(path))
    log.meta["kind"] = _check_kind(log.meta["kind"], KINDS, beside)
    if "noise" in log.meta:
        units = {name: log.unit(name) for name in log.names}
        log.meta["noise"], log.meta["noise_time"] = _check_noise(log.meta["noise"], units, beside)
    return _without_absurd(_with_torques(log))


def _with_torques(log: Trajectory) -> Trajectory:
    """A robot's log without any torque, with torques of zero that count as unknown."""
    legs = [name.removesuffix("/hip/q") for name in log.names if name.endswith("/hip/q")]
    if log.meta["kind"] != "robot" or not legs or any(f"{leg}/hip/tau" in log for leg in legs):
        return log
    zero = {f"{leg}/hip/tau [N.m]": np.zeros(len(log)) for leg in legs}
    found = log.with_columns(zero)
    said = (
        "no hip torques are logged: they are taken as unknown, so that nothing can be said about "
        "motors and hips, and less about the body"
    )
    found.meta |= {"torques": False, "read": [*log.meta.get("read", []), said]}
    return found


def _turned(log: Trajectory) -> Trajectory:
    """The log with angles that begin anew after each turn joined, but for `log.meta["kept"]`."""
    kept = log.meta.pop("kept", ())
    angles = [
        n for n in log.names if log.unit(n) == "rad" and not n.endswith("/v") and n not in kept
    ]
    found = {f"{name} [rad]": unwrapped(log[name]) for name in angles if wraps(log[name])}
    if not found:
        return log
    named = ", ".join(header.split(" [")[0] for header in found)
    said = f"{named} begins anew after each turn: joined"
    joined = log.with_columns(found)
    joined.meta["read"] = [*log.meta.get("read", []), said]
    return joined


def _without_absurd(log: Trajectory) -> Trajectory:
    """The log without readings that no channel, or a few that this one cannot have."""
    limits, broken = GateSettings, {}
    for name, y in log.items():
        wild = np.abs(y) > limits.absurd
        if known := range_of(name):
            outside = (y < known[0]) | (y > known[1])
            wild |= outside & (outside.sum() <= limits.impossible * len(y))
        if wild.any():
            broken[f"{name} [{log.unit(name)}]"] = np.where(wild, np.nan, y)
    return log.with_columns(broken)


def read_logs(paths: Sequence[str | Path], columns: Columns = None) -> list[Trajectory]:
    """Several logs of one kind, in the order of their names and not of the arguments.

    Raises KembaError for none, for unreadable ones and for robot and bench logs together.
    """
    if not paths:
        raise KembaError("", "no log given", "one or more CSV files were expected")
    columns = map_of(columns)  # once for all
    unique = {Path(p).resolve(): Path(p) for p in paths}.values()
    logs = [read_log(p, columns) for p in sorted(unique, key=lambda p: (p.name, str(p)))]
    kinds = {log.meta["kind"] for log in logs}
    if len(kinds) > 1:
        named = ", ".join(f"{log.meta['name']}: {log.meta['kind']}" for log in logs)
        raise KembaError("", "logs of several kinds cannot be fitted together", named)
    names = [log.meta["name"] for log in logs]
    for log in logs:
        if names.count(log.meta["name"]) > 1:  # logs of one name get their folder's before it
            path = Path(log.meta["path"]).resolve()
            log.meta["name"] = f"{path.parent.name}/{path.stem}"
    return logs


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
    if log.meta["kind"] in OWN_RIGS:
        return tuple(log.meta.get("logged", ()))
    legs = legs_of(log) or ("<leg>",)
    return (*BODY, *(f"{leg}/{name}" for leg in legs for name in LEG))


def taken_on(logs: Iterable[Trajectory], mechanism: Mechanism) -> None:
    """Note in the logs on which machine they were taken: its legs and its stroke [m], or for a rig
    of the user's own its kind and the columns that it needs. Raises KembaError where logs of such
    a rig meet a model of another machine."""
    for log in logs:
        if mechanism.rig:
            log.meta["kind"], log.meta["logged"] = mechanism.rig, mechanism.logged
            if mechanism.bore is not None:
                log.meta["stroke"] = mechanism.stroke
            continue
        if log.meta["kind"] in OWN_RIGS:
            what = f"is a log of a {log.meta['kind']} rig, and the model has no such rig"
            expected = f"a model with `rig: {{kind: {log.meta['kind']}, ...}}` was expected"
            hint = "name it with --model; docs/logs.md shows one"
            raise KembaError(str(log.meta.get("path", log.meta["name"])), what, expected, hint)
        log.meta["stroke"] = mechanism.stroke
        if log.meta["kind"] == "robot":
            log.meta["legs"] = list(mechanism.legs)


def is_log(log: Trajectory) -> bool:
    """Whether a table is a robot's or a rig's log: its sidecar says so, or its columns do."""
    if "kind" in log.meta:
        return True
    try:
        kind_of(log)
    except KembaError:
        return False
    return True


def kind_of(log: Trajectory, where: str | Path = "") -> Kind:
    """Robot, bench or a rig of the user's own, by the columns.

    Raises KembaError for a log that is none of these.
    """
    if any(name.startswith("body/") or "/hip/" in name for name in log.names):
        return "robot"
    if "axis/q" in log:
        return "drive"
    if "vessel/P" in log:
        return "vessel"
    pressed = any(name in log for name in ("chamber/extend/P", "chamber/retract/P"))
    if pressed and not any("valve/" in name for name in log.names):
        return "cylinder"
    if any(name in BENCH for name in log.names):
        return "bench"
    raise KembaError(
        f"{where}:1",
        "has neither the columns of a robot log nor those of a bench log",
        f"at least {', '.join(BENCH)} of a rig, or body/z and so on of a robot, were expected",
        map_hint(where),
    )


ROWS = 60_000  # largest number of rows of all logs together: one minute at 1 kHz
PIECE = 2.0  # length of the pieces that are kept of a long log [s]
FINEST = 7e-4  # rows closer than this are thinned [s]: below it, two rows fit into 1 ms
# distance of rows after thinning [s]: an eighth of the fastest rise time of a chamber (8 ms,
# Table I)
STEP = 1e-3


def excerpts(logs: Sequence[Trajectory]) -> tuple[list[Trajectory], list[str]]:
    """The logs, thinned and cut into pieces where they are too long, and remarks about it."""
    found, remarks = [], []
    for log in logs:
        thin = thinned(log)
        if thin is not log:
            remarks.append(f"{log.meta['name']}: {len(thin)} of {len(log)} rows are used")
        found.append(thin)
    total = sum(len(log) for log in found)
    if total <= ROWS:
        return found, remarks
    share = ROWS / total
    pieces = [piece for log in found for piece in cut(log, share)]
    remarks.append(
        f"{total} rows are more than a search needs: {len(pieces)} pieces of {PIECE:g} s are used"
    )
    return pieces, remarks


def thinned(log: Trajectory) -> Trajectory:
    """One row per millisecond, and every row in which a valve switches."""
    step = float(np.median(np.diff(log.time)))
    group = round(STEP / step) if step < FINEST else 1
    if group < 2:
        return log
    chosen = np.arange(len(log)) % group == 0
    for name in log.names:
        if "valve/" in name:
            chosen[1:] |= np.diff(held(log[name])) != 0
    return log.rows(chosen)


def cut(log: Trajectory, share: float) -> list[Trajectory]:
    """Pieces spread evenly over the log that make up `share` of it."""
    span = float(log.time[-1] - log.time[0])
    wanted = max(1, int(span * share / PIECE))
    if span <= 2 * PIECE:
        return [log]
    starts = log.time[0] + (span - PIECE) * (np.arange(wanted) + 0.5) / wanted
    return [part(log, start, start + PIECE) for start in starts]


def part(log: Trajectory, start: float, end: float) -> Trajectory:
    """The rows of a log between two times [s]."""
    piece = log.rows((log.time >= start) & (log.time < end))
    piece.meta["name"] = f"{log.meta['name']}@{start:.1f}s"
    return piece


def held(values: Array) -> Array:
    """Commands (n,); a missing one is replaced by the last one that was sent."""
    good = np.isfinite(values)
    if good.all():
        return values
    last = np.maximum.accumulate(np.where(good, np.arange(len(values)), -1))
    first = int(np.argmax(good))
    return np.asarray(values[np.where(last < 0, first, last)])
