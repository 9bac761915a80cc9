"""Times written as texts: dates, clocks of day, durations."""

from __future__ import annotations

import re

import numpy as np

from kemba.logs.recording import Column
from kemba.trajectory import Array

CLOCK = re.compile(
    r"(?:(?P<days>[+-]?\d+) days?,? *)?(?P<sign>[+-])?(?:(?P<hour>\d{1,2}):)?(?P<minute>\d{1,2}):"
    r"(?P<second>\d{1,2})(?P<rest>[.,:]\d+)? *(?P<half>[AaPp][Mm])?(?P<zone>Z|[+-]\d\d:?\d\d)?"
)
COMPACT = re.compile(r"\d{8}[T_ -]?(\d\d)(\d\d)(\d\d)([.,]\d+)?")
DATE = re.compile(
    r"(?:[A-Za-z]{3,9},? +)?"  # a day of the week
    r"(?:\d{1,4}[-./]\d{1,2}[-./]\d{1,4}|\d{1,2}[- ][A-Za-z]{3,9}[- ,]+\d{2,4}"
    r"|[A-Za-z]{3,9} +\d{1,2},? +\d{4})"
    r"(?:,? +|T|_)"
)
DAY, HOUR = 86_400.0, 3_600.0


def seconds(cells: Column) -> Array | None:
    """Seconds (n,) since the first of the texts (n,): dates in any order, clocks of day, durations;
    NaN for an empty cell. None where a text is no time.

    Dates need not be understood: a clock that falls by more than half its day has passed midnight.
    """
    texts = [str(cell).strip() for cell in cells]
    known = [text for text in texts if text and text.lower() not in ("nan", "nat", "none")]
    if len(known) < 2 or not all(":" in text or COMPACT.fullmatch(text) for text in known[:3]):
        return None
    found, zones = np.full(len(texts), np.nan), set()
    wrap = 0.0
    for i, text in enumerate(texts):
        if not text or text.lower() in ("nan", "nat", "none"):
            continue
        read = _clock(text)
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


def _clock(text: str) -> tuple[float, float, str] | None:
    """Seconds, after how many the clock begins anew (0 for a duration), and the time zone."""
    compact = COMPACT.fullmatch(text)
    if compact:
        hour, minute, second, rest = compact.groups()
        fraction = float("0" + (rest or ".0").replace(",", "."))
        return 3600 * int(hour) + 60 * int(minute) + int(second) + fraction, DAY, ""
    date = DATE.match(text)
    match = CLOCK.fullmatch(text[date.end() :] if date else text)
    if match is None:
        return None
    hour, days = int(match["hour"] or 0), match["days"]
    if match["half"]:
        hour = hour % 12 + (12 if match["half"].lower() == "pm" else 0)
    fraction = float("0." + match["rest"][1:]) if match["rest"] else 0.0
    value = 3600 * hour + 60 * int(match["minute"]) + int(match["second"]) + fraction
    if days is not None:
        return int(days) * DAY + value, 0.0, ""
    value = -value if match["sign"] == "-" else value
    return value, DAY if match["hour"] else HOUR, match["zone"] or ""
