"""From sent valve commands to what the valves do: dead time, late closing, merged pulses."""

import numpy as np

from .figures import DEAD_TIME

VALVES = ("front/valve/extend", "front/valve/retract", "rear/valve/extend", "rear/valve/retract")


def pulses_of(ticks: np.ndarray, sent: np.ndarray) -> list[tuple[float, float]]:
    """On-intervals of one 0/1 column; a pulse still on at the end has no end."""
    on = np.asarray(sent) > 0.5
    edges = np.flatnonzero(np.diff(on.astype(int))) + 1
    starts = [0] * bool(on[0]) + [i for i in edges if on[i]]
    ends = [i for i in edges if not on[i]]
    closing = [ticks[i] for i in ends] + [np.inf] * (len(starts) - len(ends))
    return list(zip((ticks[i] for i in starts), closing, strict=True))


def shifted(pulses, on_delay: float, off_delay: float) -> list[tuple[float, float]]:
    """Pulses after switching delays; those that overlap merge, those that vanish are dropped."""
    late = sorted((a + on_delay, b + off_delay) for a, b in pulses)
    merged: list[list[float]] = []
    for a, b in late:
        if b <= a:
            continue
        if merged and a <= merged[-1][1]:
            merged[-1][1] = max(merged[-1][1], b)
        else:
            merged.append([a, b])
    return [(a, b) for a, b in merged]


def events(ticks: np.ndarray, sent: np.ndarray, extra: np.ndarray) -> np.ndarray:
    """Rows (time, valve number, value), sorted.  `extra[leg]` = later on, later off than 6 ms."""
    rows = []
    for valve in range(sent.shape[1]):
        on, off = DEAD_TIME + extra[valve // 2]
        for a, b in shifted(pulses_of(ticks, sent[:, valve]), on, off):
            rows.append((a, valve, 1.0))
            if np.isfinite(b):
                rows.append((b, valve, 0.0))
    rows.sort()
    return np.array(rows, dtype=float).reshape(-1, 3)
