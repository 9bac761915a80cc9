"""Times of recordings: stamps of any kind, rates, gaps."""

import re
from collections.abc import Collection, Sequence

import numpy as np

from kemba.logs.recording import Column, some
from kemba.trajectory import Array, Trajectory

CLOCK = re.compile(
    r"(?:(?P<days>[+-]?\d+) days?,? *)?(?P<sign>[+-])?(?:(?P<hour>\d{1,2}):)?(?P<minute>\d{1,2}):"
    r"(?P<second>\d{1,2})(?P<rest>[.,:]\d+)? *(?P<half>[AaPp][Mm])?"
    r" *(?P<zone>Z|[A-Z]{3,4}|[+-]\d\d:?\d\d)?(?: +\d{4})?"  # a year behind, as of C's ctime
)
COMPACT = re.compile(r"\d{8}[T_ -]?(\d\d)(\d\d)(\d\d)([.,]\d+)?")
# a date of any language: what has a number and no colon, apart from the clock
DATE = re.compile(r"[^:]*\d[^:]*?(?:[^\w:+-]|(?<=\d)T|_)(?=\d)")
DAY, HOUR = 86_400.0, 3_600.0
COUNTERS = (2**16, 2**32)  # after so many counts clocks of controllers begin anew
PART = re.compile(
    r"(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)\s*(?P<unit>[a-zµ]+)\s*", re.IGNORECASE
)
PARTS = {  # of a duration such as `1 min 2.5 s`, `100ms` or `PT0.1S`, by its first letters
    "d": DAY, "h": HOUR, "min": 60.0, "m": 60.0, "s": 1.0, "sec": 1.0, "ms": 1e-3, "msec": 1e-3,
    "us": 1e-6, "µs": 1e-6, "usec": 1e-6, "ns": 1e-9, "nsec": 1e-9,
}  # fmt: skip


def seconds(cells: Column) -> Array | None:
    """Seconds (n,) since the first of the texts (n,): dates in any order, clocks of day, durations;
    NaN for an empty cell. None where a text is no time.

    Dates need not be understood: a clock that falls by more than half its day has passed midnight.
    What stands behind the seconds is a count, as of ms without zeros before them, where the clock
    goes back else.
    """
    texts = [str(cell).strip() for cell in cells]
    known = [text for text in texts if text and text.lower() not in ("nan", "nat", "none")]
    if len(known) < 2 or any(_clock(text) is None for text in known[:3]):
        return None
    found = _read(texts)
    widths = {len(match["rest"] or "") for text in known if (match := _match(text))}
    if found is None or _forward(found) or len(widths) < 2:
        return found
    counted = _read(texts, max(widths) - 1)  # less the mark
    return counted if counted is not None and _forward(counted) else found


def joined(counted: Column) -> tuple[Column, int]:
    """Counts (n,) of a clock, those of a counter of 16 or 32 bit that begins anew joined, and
    after how many it does; 0 where it does not, or does not go on at its own pace."""
    try:
        whole = counted if counted.dtype.kind == "f" else counted.astype(np.int64)
    except (OverflowError, TypeError, ValueError):  # texts, or numbers too large for any counter
        return counted, 0
    if not np.isfinite(whole).all():
        return counted, 0
    steps = np.diff(whole)
    for turn in COUNTERS:
        turns = np.concatenate([[0], np.cumsum(steps < 0)])
        found = whole + turn * turns
        pace = LONGEST * np.median(np.abs(steps)) if len(steps) else 0.0
        falls = np.diff(found)[steps < 0]
        if len(falls) and whole.max() < turn and np.all((falls > 0) & (falls < pace)):
            return found, turn
    return counted, 0


def _forward(times: Array) -> bool:
    return bool(np.all(np.diff(times[np.isfinite(times)]) >= 0.0))


def _read(texts: Sequence[str], digits: int = 0) -> Array | None:
    """Seconds (n,) since the first text; `digits` of the count behind the seconds, if it is one."""
    found, zones = np.full(len(texts), np.nan), set()
    wrap = 0.0
    for i, text in enumerate(texts):
        if not text or text.lower() in ("nan", "nat", "none"):
            continue
        read = _clock(text, digits)
        if read is None:
            return None
        found[i], wrap, zone = read
        zones.add(zone)
    if len(zones) > 1:  # the clock was put forward or back on the way
        return None
    good = np.isfinite(found)
    steps = np.diff(found[good])
    if wrap:
        turns = np.concatenate([[0], np.cumsum(steps < -0.5 * wrap)])
        found[good] += wrap * turns
    return np.asarray(found - found[good][0])


def _match(text: str) -> re.Match[str] | None:
    """The clock of day in a text, behind its date."""
    text = text.strip("[]() ")
    if clock := CLOCK.fullmatch(text):
        return clock
    date = DATE.match(text)
    return CLOCK.fullmatch(text[date.end() :]) if date else None


def _clock(text: str, digits: int = 0) -> tuple[float, float, str] | None:
    """Seconds, after how many the clock begins anew (0 for a duration), and the time zone."""
    compact = COMPACT.fullmatch(text)
    if ":" not in text and not compact:
        duration = _duration(text)
        return None if duration is None else (duration, 0.0, "")
    if compact:
        hour, minute, second, rest = compact.groups()
        fraction = float("0" + (rest or ".0").replace(",", "."))
        return 3600 * int(hour) + 60 * int(minute) + int(second) + fraction, DAY, ""
    match = _match(text)
    if match is None:
        return None
    hour, days = int(match["hour"] or 0), match["days"]
    if match["half"]:
        hour = hour % 12 + (12 if match["half"].lower() == "pm" else 0)
    rest = (match["rest"] or ".0")[1:]
    fraction = int(rest) / 10**digits if digits else float(f"0.{rest}")
    value = 3600 * hour + 60 * int(match["minute"]) + int(match["second"]) + fraction
    if days is not None:
        return int(days) * DAY + value, 0.0, ""
    value = -value if match["sign"] == "-" else value
    return value, DAY if match["hour"] else HOUR, match["zone"] or ""


def _duration(text: str) -> float | None:
    """Seconds of numbers with units of time, or of ISO 8601's durations; None where it is none."""
    text = re.sub(r"^P(\d.*)?T", r"\1", text).replace(",", ".")
    parts = list(PART.finditer(text))
    units = [PARTS.get(part["unit"].lower()) for part in parts]
    if "".join(part[0] for part in parts) != text or None in units or not parts:
        return None
    return sum(
        float(part["number"]) * unit for part, unit in zip(parts, units, strict=True) if unit
    )


FULL = 0.9  # share of the rows in which the fastest channel is read, of a table of one rate
LONGEST = 2.5  # steps of a channel; farther apart, nothing is known between two readings
COMMANDS = ("valve/extend", "valve/retract", "hip/tau")


def is_command(name: str) -> bool:
    """Whether a column is a command, which holds until the next one; else it is measured."""
    return f"/{name.split(' [')[0]}".endswith(tuple(f"/{command}" for command in COMMANDS))


def placed(time: Array, own: Array, values: Array, hold: bool) -> Array:
    """Readings `values` (m,) at `own` times (m,) on the clock `time` (n,), else NaN.

    A reading stands at the nearest row, at the value that the channel has there between its own
    readings; a command is held from the first row after it was sent.
    """
    good = np.isfinite(values) & np.isfinite(own)
    own, values = own[good], values[good]
    if not len(own):
        return np.full(len(time), np.nan)
    if hold:
        last = np.searchsorted(own, time, side="right") - 1
        return np.where(last < 0, np.nan, values[np.clip(last, 0, None)])
    step = float(np.median(np.diff(time))) if len(time) > 1 else np.inf
    after = np.clip(np.searchsorted(time, own), 1, len(time) - 1)
    rows = np.where(own - time[after - 1] < time[after] - own, after - 1, after)
    rows = np.unique(rows[np.abs(time[rows] - own) < step])
    following = np.clip(np.searchsorted(own, time[rows]), 1, len(own) - 1)
    known = own[following] - own[following - 1] < LONGEST * np.median(np.diff(own))
    found = np.full(len(time), np.nan)
    found[rows[known]] = np.interp(time[rows[known]], own, values)
    return found


def one_clock(log: Trajectory) -> Trajectory:
    """The log on the rows of its fastest channel, of equally fast ones those of the commands, where
    its rows belong to channels of several clocks; others are `placed` there. A log of one rate is
    returned as it is."""
    log = _joined_rows(log)
    counts = {name: int(np.isfinite(log[name]).sum()) for name in log.names}
    fast = [name for name in counts if counts[name] > FULL * max(counts.values())]
    widest = max(fast, key=lambda name: (is_command(name), counts[name]), default="")
    if not widest or not 2 < counts[widest] < FULL * len(log) or not np.all(np.diff(log.time) > 0):
        return log
    if not any(_elsewhere(log[widest], log[name]) for name in log.names):
        return log  # rows are missing, no second clock
    rows = np.isfinite(log[widest])
    columns = {
        header: placed(log.time[rows], log.time, log[name], is_command(name))
        for header, name in zip(log.headers, log.names, strict=True)
    }
    slower = [name for name in log.names if _elsewhere(log[widest], log[name])]
    said = merged(slower, float(np.median(np.diff(log.time[rows]))))
    meta = {**log.meta, "read": [*log.meta.get("read", []), said]}
    return Trajectory(log.time[rows], columns, meta)


def merged(names: Collection[str], step: float) -> str:
    """The sentence about channels that were put on another clock with rows `step` [s] apart."""
    return (
        f"{some(names, 3)} have a clock of their own: their readings stand in the nearest of rows "
        f"{1e3 * step:.3g} ms apart, empty between readings; commands are held"
    )


def _elsewhere(base: Array, other: Array) -> bool:
    """Whether a column is mostly read where the base is not."""
    read = np.isfinite(other)
    return bool(read.any()) and float(np.mean(np.isnan(base[read]))) > 0.5


def _joined_rows(log: Trajectory) -> Trajectory:
    """The log with rows of one stamp as one, where none of its columns is read twice in them."""
    steps = np.diff(log.time)
    if not len(steps) or not np.all(steps >= 0) or not np.any(steps == 0):
        return log
    first = np.concatenate([[True], steps > 0])
    row = np.cumsum(first) - 1
    columns = {}
    for header, values in log.columns.items():
        good = np.isfinite(values)
        if len(np.unique(row[good])) < good.sum():
            return log
        columns[header] = np.full(int(first.sum()), np.nan)
        columns[header][row[good]] = values[good]
    return Trajectory(log.time[first], columns, log.meta)


def rate_missing(time: Array, values: Array) -> tuple[float, float]:
    """The median distance [s] between the readings of a channel, and the share of readings that
    are missing at that rate."""
    good = np.isfinite(values) & np.isfinite(time)
    if good.sum() < 2:
        return np.inf, 1.0
    step = float(np.median(np.diff(time[good])))
    expected = 1.0 + (time[-1] - time[0]) / step if step > 0 else len(time)
    return step, float(np.clip(1.0 - good.sum() / expected, 0.0, 1.0))
