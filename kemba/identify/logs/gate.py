"""Checks before a fit: a log that cannot be right is refused, with row and column; and remarks on
what the way in which logs were taken costs."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from kemba.effects.sensors import CHANNELS
from kemba.errors import ConfigErrors, KembaError, suggest
from kemba.events import runs
from kemba.identify.logs.reading import OWN_RIGS, GateSettings, legs_of, needed, range_of
from kemba.identify.problem.noise import difference_sigma, is_coarse, step_of
from kemba.logs.times import rate_missing
from kemba.trajectory import TIME, Array, Trajectory

UNMAPPED = "of a log of another program, give its source in the column map (--map)"


def _log_fault(
    log: Trajectory,
    what: str,
    expected: str = "",
    hint: str = "",
    row: int | None = None,
    column: str = "",
) -> KembaError:
    """What is wrong with a log, at its place; `row` counts from 0."""
    where = log.meta.get("path", log.meta.get("name", "log"))
    if row is not None:
        names = ["time", *log.names]
        bare = column.split(" [")[0]
        at = names.index(bare) + 1 if bare in names else 1
        where = f"{where}:{row + 2}:{at}"
    return KembaError(f"{where}: {column}" if column else where, what, expected, hint)


FEWEST_STILL = 8  # readings per channel that a vessel's log needs
VACUUM = 2e4  # no rig's pressure is below this [Pa]: gauge or bar read so as pascals
END = 0.1  # share of the stroke within which a moving rod may be one in another unit
SHARE = 0.2  # travel, as a share of the farthest place, from which a rod moves
FOLLOWED = 0.1  # share of the travel that a row may be from the one before
UNMOVED = 3.0  # a position with less travel than so many of its steps rests


class BadData(ConfigErrors):
    """What is wrong with the logs, all of it; the verdict is `bad-data`."""


def check_logs(logs: Sequence[Trajectory]) -> list[str]:
    """Raise BadData with every fault found; remarks on what was tolerated are returned."""
    faults = [fault for log in logs for fault in _faults(log)]
    if faults:
        raise BadData(faults)
    return [remark for log in logs for remark in _remarks(log)]


def _faults(log: Trajectory) -> list[KembaError]:
    """Faults of one log; a later check runs only where the earlier ones found nothing."""
    stages = (_columns, _time, _cells, _values)
    if log.meta["kind"] in OWN_RIGS:
        stages = (_columns, _time, _rig_readings, _rig_excitation)
    for stage in stages:
        found = list(stage(log))
        if found:
            return found
    return []


def _columns(log: Trajectory) -> Iterator[KembaError]:
    """Columns that are needed, all known ones in their units; of a vessel, pressure or temperature
    will do."""
    kind, logged = log.meta["kind"], log.meta.get("logged", {})
    rig = kind in OWN_RIGS
    enough = kind == "vessel" and any(name in log for name in logged)
    for name in needed(log):
        if name not in log and not enough:
            hint = "; ".join(filter(None, (suggest(name, log.names), UNMAPPED)))
            header = f"{name} [{logged[name]}]" if rig else name
            why = "the model's rig asks for it" if rig else ""
            yield _log_fault(log, f"needs the column '{header}', which is missing", why, hint)
    for name in log.names:
        unit = "1" if "valve/" in name else None
        if range_of(name):
            unit = CHANNELS[name.split("/")[-1]][0]
        unit = logged.get(name) if rig else unit
        if unit is not None and log.unit(name) != unit:
            what = f"the column's unit is [{log.unit(name)}]"
            hint = "convert it with --map" + "; is the axis of the rig linear or rotary?" * rig
            yield _log_fault(log, what, f"'{name} [{unit}]' was expected", hint, column=name)


def _clock(log: Trajectory, fewest: int) -> Iterator[KembaError]:
    """Enough rows, and times that increase from one to the next."""
    t = log.time
    if len(t) < fewest:
        yield _log_fault(log, f"has {len(t)} rows", f"at least {fewest} were expected")
        return
    wrong = ~np.isfinite(t)
    wrong[1:] |= ~(np.diff(t) > 0)
    if wrong.any():
        i = int(np.argmax(wrong))
        what = "the time is missing"
        if np.isfinite(t[i]):
            same = "is repeated" if i and t[i] == t[i - 1] else "goes back"
            what = f"the time {same}: {t[i]:.6f} s after {t[i - 1]:.6f} s"
        count = f"{int(wrong.sum())} such rows; are rows duplicated, or clocks mixed?"
        expected = "times must increase from row to row"
        yield _log_fault(log, what, expected, count, row=i, column=TIME)


def _time(log: Trajectory) -> Iterator[KembaError]:
    t, limits, kind = log.time, GateSettings, log.meta["kind"]
    faults = list(_clock(log, FEWEST_STILL if kind == "vessel" else limits.fewest))
    if faults or kind in OWN_RIGS:
        yield from faults
        places = [n for n in needed(log) if n.endswith(("/x", "/q"))]
        if not faults and kind != "vessel" and not all(_follows(log[n]) for n in places):
            yield from _seldom(log, limits.milliseconds)
        return
    span = t[-1] - t[0]
    if span < limits.shortest:
        expected = f"at least {limits.shortest} s were expected"
        yield _log_fault(log, f"lasts {span:.3f} s", expected)
    faults = list(_seldom(log, limits.slowest))
    yield from faults
    if not faults and span > limits.gaps * len(t):
        yield _log_fault(log, "has gaps longer than all of its rows", column=TIME)


def _seldom(log: Trajectory, slowest: float) -> Iterator[KembaError]:
    """Rows that are farther apart than `slowest` [s]."""
    step = float(np.median(np.diff(log.time)))
    if step > slowest:
        in_ms = step > GateSettings.milliseconds
        hint = "is the time in milliseconds?" if in_ms else "a chamber fills within 8 ms"
        expected = f"at least {1.0 / slowest:.0f} rows a second"
        yield _log_fault(log, f"has a row every {step:.3g} s", expected, hint)


def _cells(log: Trajectory) -> Iterator[KembaError]:
    limits = GateSettings
    for name in needed(log):
        y = log[name]
        missing = ~np.isfinite(y)
        step, share = rate_missing(log.time, y)
        if share > limits.missing:
            what = f"{100 * share:.0f} % of its readings are missing"
            yield _log_fault(log, what, column=name, row=int(np.argmax(missing)))
        elif step > limits.slowest:
            expected = f"at least {1.0 / limits.slowest:.0f} readings a second"
            yield _log_fault(log, f"has a reading every {step:.3g} s", expected, column=name)
        elif "valve/" in name:
            yield from _valve(log, name, y)


def _valve(log: Trajectory, name: str, y: Array) -> Iterator[KembaError]:
    far, state = GateSettings.valve, np.clip(np.round(y), 0.0, 1.0)
    wrong = np.isfinite(y) & (np.abs(y - state) > far)
    if wrong.any():
        i = int(np.argmax(wrong))
        what = f"the valve command is {y[i]:g}"
        hint = "map a voltage or per cent with a scale" if y[i] > 1 else ""
        expected = f"0 or 1 within {far:g} was expected"
        yield _log_fault(log, what, expected, hint, row=i, column=name)


def _values(log: Trajectory) -> Iterator[KembaError]:
    wanted = needed(log)
    for name in log.names:
        y = log[name]
        if "valve/" in name or not np.isfinite(y).any():
            continue
        yield from _range(log, name, y)
        if name in wanted:
            yield from _frozen(log, name, y)
        if name.endswith("piston/x"):
            yield from _leap(log, name, y)
    yield from _excitation(log)


def _range(log: Trajectory, name: str, y: Array) -> Iterator[KembaError]:
    known = range_of(name)
    if known is None:
        return
    low, high, expected = known
    limits = GateSettings
    if name.endswith("piston/x") and "stroke" in log.meta:
        high = log.meta["stroke"] + limits.beyond
    outside = np.isfinite(y) & ((y < low) | (y > high))
    wanted = name in needed(log)
    few = limits.impossible if wanted else limits.impossible_elsewhere
    if outside.mean() > few:
        i = int(np.argmax(outside))
        what = f"the reading {y[i]:.6g} {log.unit(name)} cannot be ({int(outside.sum())} rows)"
        right, _, hint = expected.partition("; ")
        yield _log_fault(log, what, f"{right} expected", hint, row=i, column=name)


def _frozen(log: Trajectory, name: str, y: Array) -> Iterator[KembaError]:
    """A sensor that repeats one reading while it is noisy elsewhere: dead, stuck or saturated."""
    if name.endswith("hip/tau"):
        return
    limits = GateSettings
    good = np.flatnonzero(np.isfinite(y))
    values = y[good]
    equal = np.diff(values) == 0
    long = [(a, b) for a, b in runs(equal) if b - a >= limits.frozen]
    step = step_of(values) if long else 0.0
    held = [run for run in long if not _rests(values, *run, step)]
    if not held:
        return
    start, end = max(held, key=lambda run: run[1] - run[0])
    elsewhere = np.ones(len(equal), dtype=bool)
    for a, b in long:
        elsewhere[a:b] = False
    if not elsewhere.any() or equal[elsewhere].mean() > limits.repeats:
        return
    if difference_sigma(values) < limits.quiet * np.ptp(values):
        return  # a simulation without noise may stand still
    value, row = values[start], int(good[start])
    at_end = value in (values.max(), values.min())
    what = f"{end - start + 1} readings in a row are exactly {value:.6g} {log.unit(name)}"
    hint = "is the sensor saturated?" if at_end else "is the sensor stuck?"
    yield _log_fault(log, what, "the channel is noisy elsewhere", hint, row=row, column=name)


FEW = 2.5  # steps, within which a sensor that rests is left


def _rests(values: Array, start: int, end: int, step: float) -> bool:
    """Whether a sensor that reads in steps stands still from reading `start` to `end`: what rests,
    on a stop too, begins to move slowly; where the log ends so, it has come to rest slowly."""
    beside = values[end + 1] if end + 1 < len(values) else values[max(start - 1, 0)]
    return step > 0 and abs(float(beside - values[start])) < FEW * step


def _leap(log: Trajectory, name: str, y: Array) -> Iterator[KembaError]:
    """A position that jumps from one row to the next, and stays there."""
    limits = GateSettings
    good = np.flatnonzero(np.isfinite(y))
    step, passed = np.diff(y[good]), np.diff(log.time[good])
    far = np.abs(step) > limits.fastest * passed + limits.leap
    calm = np.abs(step) < limits.calm * np.max(np.abs(step), initial=0.0)
    far[1:-1] &= calm[:-2] & calm[2:]  # a spike returns at once: one bad reading is tolerated
    if far.any():
        i = int(np.argmax(far))
        what = f"leaps by {1e3 * step[i]:.1f} mm within {1e3 * passed[i]:.1f} ms"
        hint = "are two logs joined?"
        yield _log_fault(log, what, "a piston that moves", hint, row=int(good[i + 1]), column=name)


def _excitation(log: Trajectory) -> Iterator[KembaError]:
    """Something must be commanded or move, and no sensor may be dead."""
    limits = GateSettings
    valves = [n for n in log.names if "valve/" in n]
    switched = any(np.ptp(log[n][np.isfinite(log[n])]) > 0 for n in valves)
    moving = [n for n in needed(log) if n.endswith("/x") or n == "body/z"]
    moved = any(_travel(log[n]) > limits.moves for n in moving)
    if not switched and not moved:
        what = "no valve switches and nothing moves"
        yield _log_fault(log, what, "a log with excitation was expected")
        return
    if log.meta["kind"] == "bench" and _travel(log["piston/F"]) == 0.0:
        yield _log_fault(log, "never changes", "is the sensor dead?", column="piston/F", row=0)
    for leg in legs_of(log) if log.meta["kind"] == "robot" else ():
        for name in (f"{leg}/hip/q", f"{leg}/piston/x", "body/z"):
            if np.ptp(log[name][np.isfinite(log[name])]) == 0.0 and len(log) > limits.dead:
                yield _log_fault(log, "never changes", "is the sensor dead?", column=name, row=0)


def _travel(y: Array) -> float:
    good = y[np.isfinite(y)]
    return float(np.ptp(np.percentile(good, [0.5, 99.5]))) if len(good) else 0.0


def _remarks(log: Trajectory) -> Iterator[str]:
    name = log.meta["name"]
    yield from (f"{name}: {said}" for said in log.meta.get("read", ()))
    stroke = log.meta.get("stroke", 0.0)
    if "piston/x" in log and (doubted := unit_in_doubt(log["piston/x"], stroke)):
        yield f"{name}: {doubted}, and rates of frictions with it"
    step = float(np.median(np.diff(log.time)))
    if step > GateSettings.milliseconds and log.meta["kind"] != "vessel":
        yield (
            f"{name}: a row every {step:.3g} s: if the time was in milliseconds, all rates are "
            "wrong (see --map)"
        )
    gaps = np.diff(log.time) > 5 * step
    if gaps.any():
        yield f"{name}: {int(gaps.sum())} gaps in time, the longest {np.diff(log.time).max():.3f} s"
    for column in needed(log):
        step, share = rate_missing(log.time, log[column])
        missing = round(share * (1 + (log.time[-1] - log.time[0]) / step))
        if missing:
            yield f"{name}: {column}: {missing} reading{'s' * (missing > 1)} missing"


def unit_in_doubt(x: Array, stroke: float) -> str:
    """That a rod which stays at `x` (n,) [m] may be one in another unit; empty where not."""
    farthest = float(np.nanmax(np.abs(x)))
    if farthest >= END * stroke or _travel(x) <= SHARE * farthest:
        return ""
    return (
        f"piston/x stays within {1e3 * farthest:.3g} mm of the retracted end, of a stroke of "
        f"{1e3 * stroke:.4g} mm: if the rod moved farther, its unit is wrong (see --map)"
    )


def sentence(faults: Iterable[KembaError]) -> str:
    """All faults as one text, the first few in full."""
    faults = list(faults)
    more = f" (and {len(faults) - 3} more)" if len(faults) > 3 else ""
    return "The data cannot be right: " + " | ".join(str(f) for f in faults[:3]) + more


def _follows(y: Array) -> bool:
    """Whether a channel changes by little of its travel from one row to the next."""
    return bool(np.nanmedian(np.abs(np.diff(y))) < FOLLOWED * _travel(y))


def _rig_readings(log: Trajectory) -> Iterator[KembaError]:
    vessel = log.meta["kind"] == "vessel"
    for name in log.meta.get("logged", {}):
        if name not in log:
            continue
        y = log[name]
        good = np.isfinite(y)
        if vessel and good.sum() < FEWEST_STILL:
            what = f"has {int(good.sum())} readings"
            yield _log_fault(log, what, f"at least {FEWEST_STILL} were expected", column=name)
        elif not vessel and 1.0 - good.mean() > GateSettings.missing:
            what = f"{100 * (1.0 - good.mean()):.0f} % of its readings are missing"
            yield _log_fault(log, what, column=name, row=int(np.argmin(good)))
        elif name.endswith("/P") and np.median(y[good]) < VACUUM:
            what = f"reads {np.median(y[good]):.4g} Pa, less than any air pressure"
            hint = "is it in bar or kPa, or above the atmosphere? Convert it with --map"
            yield _log_fault(log, what, "pascals, absolute, were expected", hint, column=name)
        elif name == "piston/x" and _travel(y) > log.meta["stroke"] + GateSettings.beyond:
            what = f"moves by {1e3 * _travel(y):.4g} mm"
            expected = f"a stroke of {1e3 * log.meta['stroke']:.4g} mm was expected"
            yield _log_fault(log, what, expected, "is its unit wrong? See --map", column=name)


def _rig_excitation(log: Trajectory) -> Iterator[KembaError]:
    for name in log.meta.get("logged", {}):
        if name not in log:
            continue
        y = log[name][np.isfinite(log[name])]
        steps = np.diff(np.unique(y))
        if not len(steps):
            hint = "is the sensor dead, or the rig at rest?"
            yield _log_fault(log, "never changes", "a log of a rig that works", hint, 0, name)
        elif name.endswith(("/x", "/q")) and np.ptp(y) < UNMOVED * (steps.min()):
            yield _log_fault(log, "hardly moves", "a log with motion was expected", column=name)


# When the way in which logs were taken is worth a remark.
ROW = 1.25e-3  # step between rows from which it is said [s]: logs have 1 ms
UNEVEN = 0.1  # spread of the steps, as a share of the usual one, from which it is said
# rates to which recorders are set, without their power of ten: round numbers and powers of two
USUAL = (1.0, 1.024, 1.2, 1.25, 2.0, 2.048, 2.5, 2.56, 4.0, 5.0, 5.12, 8.0)
# share by which a rate is off the nearest usual one where the clock is doubted: clocks are good
# to less than 1 %; farther off, it is another rate
ODD = (0.01, 0.08)
COARSE = 5e-3  # steps of a channel, as a share of its range, that are worth a remark


def limits_of(logs: Sequence[Trajectory]) -> list[str]:
    """Remarks on what these logs cannot show, or show worse than others would."""
    found = _slow(logs), _uneven(logs), _odd(logs), _coarse(logs), _unused(logs), _locked(logs)
    return [remark for remarks in found for remark in remarks]


def _slow(logs: Sequence[Trajectory]) -> Iterable[str]:
    step = max(float(np.median(np.diff(log.time))) for log in logs)
    if step > ROW:
        valves = any("valve/" in name for log in logs for name in log.names)
        blurred = (
            f"blurs valve edges to {1e3 * step:.2g} ms: valve delays are known worse than from "
            "1 kHz, and "
        )
        yield (
            f"{1 / step:.0f} Hz{' ' + blurred if valves else ': '}"
            f"time constants below {1e3 * step:.2g} ms do not show"
        )
        if logs[0].meta.get("kind") == "bench":
            yield (
                "the moments of the valve commands are known to a row only: shorter delays and "
                "formulas are not looked for"
            )


def _uneven(logs: Sequence[Trajectory]) -> Iterable[str]:
    worst, usual = 0.0, 1e-3
    for log in logs:
        steps = np.diff(log.time)
        low, middle, high = np.quantile(steps, (0.16, 0.5, 0.84))
        if high - low > 2.0 * worst:
            worst, usual = 0.5 * float(high - low), float(middle)
    if worst > UNEVEN * usual:
        yield (
            f"rows come unevenly, {1e3 * usual:.2g} ms +- {1e3 * worst:.2g} ms apart: commands are "
            "known to act at the written times only as well as that"
        )


def _odd(logs: Sequence[Trajectory]) -> Iterable[str]:
    """A rate that nobody sets is a usual one by a clock that is wrong."""
    rate = 1.0 / float(np.median([np.median(np.diff(log.time)) for log in logs]))
    size = 10.0 ** np.floor(np.log10(rate))
    usual = np.array([*USUAL, 10.0]) * size
    nearest = float(usual[np.argmin(np.abs(np.log(usual / rate)))])
    off = nearest / rate - 1.0
    if ODD[0] < abs(off) < ODD[1]:
        word = "long" if off > 0 else "short"
        yield (
            f"{rate:.4g} rows a second is an odd rate: if the recorder was set to "
            f"{nearest:.4g} Hz, its seconds are {100 * abs(off):.1f} % too {word}, and so are the "
            f"delays and rise times that are found. `scale: {rate / nearest:.4g}` for the time in "
            "a map puts it right"
        )


def _coarse(logs: Sequence[Trajectory]) -> Iterable[str]:
    """Channels whose steps are larger than their noise."""
    steps: dict[str, float] = {}
    for log in logs:
        for name in log.names:
            y = log[name][np.isfinite(log[name])]
            if "valve/" in name or name.endswith("/tau") or len(y) < 2:
                continue
            step = step_of(y)
            if step > COARSE * np.ptp(y) and is_coarse(step, difference_sigma(y)):
                steps[f"{name} [{log.unit(name)}]"] = step
    for channel, step in steps.items():
        name, _, unit = channel.partition(" [")
        yield (
            f"{name} comes in steps of {step:.3g} {unit.removesuffix(']')}, which are larger than "
            f"its noise: they count as noise of {step / np.sqrt(12.0):.2g} (a step over sqrt(12))"
        )


def _unused(logs: Sequence[Trajectory]) -> Iterable[str]:
    if logs[0].meta.get("kind") == "robot" and any("/chamber/" in n for g in logs for n in g.names):
        yield (
            "chamber pressures are in these logs and are not used: of a robot the motion alone is "
            "explained. Take a bench log of this cylinder to use its pressures"
        )


def _locked(logs: Sequence[Trajectory]) -> Iterable[str]:
    still = GateSettings.moves
    if all("piston/x" in log and _travel(log["piston/x"]) <= still for log in logs):
        places = sorted({f"{1e3 * np.nanmedian(log['piston/x']):.0f}" for log in logs})
        yield (
            f"the rod does not move (piston/x {', '.join(places)} mm): friction, damping and "
            "cushions do not show, and a wrong place or scale of piston/x looks like other air; a "
            "log in which the rod moves tells them"
        )
