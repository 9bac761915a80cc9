"""Long logs cut down to what a search needs: about 1 kHz, and a minute of pieces spread evenly."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kemba.trajectory import Array, Trajectory

ROWS = 60_000  # of all logs together
PIECE = 2.0  # s
FINEST = 7e-4  # s; faster logs are averaged


def excerpts(logs: Sequence[Trajectory], rows: int = ROWS) -> tuple[list[Trajectory], list[str]]:
    """The logs, thinned and cut into pieces where they are too long, and remarks on it."""
    found, remarks = [], []
    for log in logs:
        thin = thinned(log)
        if thin is not log:
            remarks.append(f"{log.meta['name']}: averaged from {len(log)} to {len(thin)} rows")
        found.append(thin)
    total = sum(len(log) for log in found)
    if total <= rows:
        return found, remarks
    share = rows / total
    pieces = [piece for log in found for piece in cut(log, share)]
    remarks.append(
        f"{total} rows are more than a search needs: {len(pieces)} pieces of {PIECE:g} s are used"
    )
    return pieces, remarks


def thinned(log: Trajectory) -> Trajectory:
    """Means over groups of rows, so that steps are about 1 ms; valves keep their last value."""
    step = float(np.median(np.diff(log.time)))
    group = round(1e-3 / step) if step < FINEST else 1
    if group < 2:
        return log
    count = len(log) // group
    columns = {}
    for header, name in zip(log.headers, log.names, strict=True):
        blocks = log[name][: count * group].reshape(count, group)
        columns[header] = blocks[:, -1] if "valve/" in name else blocks.mean(axis=1)
    time = log.time[: count * group].reshape(count, group).mean(axis=1)
    return Trajectory(time, columns, log.meta)


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
    rows = (log.time >= start) & (log.time < end)
    columns = {h: log[n][rows] for h, n in zip(log.headers, log.names, strict=True)}
    name = f"{log.meta['name']}@{start:.1f}s"
    return Trajectory(log.time[rows], columns, {**log.meta, "name": name})


def held(values: Array) -> Array:
    """Commands with missing readings filled by the last one sent."""
    good = np.isfinite(values)
    if good.all():
        return values
    last = np.maximum.accumulate(np.where(good, np.arange(len(values)), -1))
    first = int(np.argmax(good))
    return np.asarray(values[np.where(last < 0, first, last)])
