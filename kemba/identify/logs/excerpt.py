"""Long logs are shortened: rows about 1 ms apart, and one minute of pieces spread over the log."""

from collections.abc import Sequence

import numpy as np

from kemba.trajectory import Array, Trajectory

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
