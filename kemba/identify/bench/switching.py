"""Valve commands as exact switching instants, with dead times and merged pulses."""

from __future__ import annotations

import numpy as np

from kemba.identify.evidence.problem import Array


def pulses(time: Array, command: Array) -> list[tuple[float, float]]:
    """On-intervals of one 0/1 column; one that is on from the start began long ago."""
    on = np.asarray(command) > 0.5
    edges = np.flatnonzero(np.diff(on.astype(int))) + 1
    starts = [float(time[i]) for i in edges if on[i]]
    ends = [float(time[i]) for i in edges if not on[i]]
    if on[0]:
        starts.insert(0, -np.inf)
    if on[-1]:
        ends.append(np.inf)
    return list(zip(starts, ends, strict=True))


def delayed(intervals: list[tuple[float, float]], on: float, off: float) -> Array:
    """Switching instants (k, 2) = (on, off) of the acting valve; overlapping pulses merge."""
    merged: list[list[float]] = []
    for start, end in ((a + on, b + off) for a, b in intervals):
        if end <= start:
            continue
        if merged and start <= merged[-1][1]:
            merged[-1][1] = max(merged[-1][1], end)
        else:
            merged.append([start, end])
    return np.array(merged, dtype=float).reshape(-1, 2)


def edges(intervals: Array) -> Array:
    """All finite switching instants."""
    flat = intervals.ravel()
    return flat[np.isfinite(flat)]


def is_on(intervals: Array, times: Array, side: str = "right") -> Array:
    """Valve state 0/1 just after (`right`) or just before (`left`) each of the times."""
    found = np.searchsorted(intervals.ravel(), times, side="right" if side == "right" else "left")
    return (found % 2).astype(float)
