"""From valve commands to what the valves do: pulses, late switching, merging of overlaps.

Simulator, bench and robot identification all switch their valves here.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np

Array = np.ndarray[Any, np.dtype[np.float64]]
Labels = np.ndarray[Any, np.dtype[np.int_]]
Pulse = tuple[float, float]  # a valve is on from the first instant to the second [s]

ON = 0.5  # a command above this is on


def pulses(time: Array, command: Array) -> list[Pulse]:
    """The pulses of a 0/1 column `command` (n,) that holds from each `time` (n,) [s] on.

    A valve that is on in the first row has always been on (-inf), one that is on in the last
    row stays on (inf).
    """
    on = np.asarray(command) > ON
    edges = np.flatnonzero(np.diff(on.astype(int))) + 1
    starts = [-np.inf] * bool(on[0]) + [float(time[i]) for i in edges if on[i]]
    ends = [float(time[i]) for i in edges if not on[i]] + [np.inf] * bool(on[-1])
    return list(zip(starts, ends, strict=True))


def inverted(sent: Iterable[Pulse]) -> list[Pulse]:
    """Pulses of a valve that is on where it was off."""
    edges = [-np.inf, *(t for pulse in sent for t in pulse), np.inf]
    return [(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if a < b]


def delayed(sent: Iterable[Pulse], on: float, off: float) -> Array:
    """Pulses (k, 2) of a valve that opens `on` and closes `off` [s] after the command.

    Pulses that overlap after the shift merge; those that vanish are dropped.
    """
    merged: list[list[float]] = []
    for start, end in ((a + on, b + off) for a, b in sent):
        if end <= start:
            continue
        if merged and start <= merged[-1][1]:
            merged[-1][1] = max(merged[-1][1], end)
        else:
            merged.append([start, end])
    return np.array(merged, dtype=float).reshape(-1, 2)


def instants(of: Iterable[Pulse] | Array) -> Array:
    """All finite switching instants (m,) [s], pulse by pulse."""
    flat = np.array(list(of), dtype=float).ravel()
    return np.asarray(flat[np.isfinite(flat)])


def changes(of: Iterable[Pulse] | Array) -> tuple[Array, Array]:
    """The finite switching instants (m,) [s], and +1 where the valve opens, -1 where it closes."""
    flat = np.array(list(of), dtype=float).ravel()
    signs = np.tile([1.0, -1.0], len(flat) // 2)
    known = np.isfinite(flat)
    return flat[known], signs[known]


def cut(times: Array, events: Array) -> tuple[Array, Labels]:
    """Times (m,) of samples at `times` (n,) and of `events` between them, in order, and the places
    (n,) of the samples among these."""
    whole = np.concatenate([times, np.clip(events, times[0], times[-1])])
    order = np.argsort(whole, kind="stable")
    place = np.empty(len(order), dtype=int)
    place[order] = np.arange(len(order))
    return whole[order], place[: len(times)]


def is_on(acting: Array, times: Array) -> Array:
    """State 0/1 (m,) of a valve with pulses (k, 2), as `delayed` gives them, just after `times`."""
    return (np.searchsorted(acting.ravel(), times, side="right") % 2).astype(float)
