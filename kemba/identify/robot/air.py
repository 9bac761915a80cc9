"""Effect states along measured motion: chambers, hoses, supply, motors; exact switching instants."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from kemba.identify.robot.track import Track

Array = np.ndarray[Any, np.dtype[np.float64]]

GAMMA = 1.0 - np.sqrt(0.5)
SETTLING = np.full(40, 0.01)  # s: steps at the first command before the log starts


class StateRunner:
    """Integrates s' = rate(q, v, s, u, p) for given motion; L-stable, as hoses may be short."""

    def __init__(self, symbols: list[ca.SX], rate: ca.SX, start: Array) -> None:
        q, v, s, u, p = symbols
        self.start = start
        if not s.numel():
            return
        h = ca.SX.sym("h")
        f = ca.Function("f", [q, v, s, u, p], [rate])
        stiff = ca.diag(ca.jacobian(rate, s))
        w = 1.0 / (1.0 - GAMMA * h * stiff)
        k1 = w * rate
        k2 = w * (f(q, v, s + h * k1, u, p) - 2 * k1)
        after = s + 1.5 * h * k1 + 0.5 * h * k2
        self._step = ca.Function("step", [s, h, q, v, u, p], [after])
        self._runs: dict[int, ca.Function] = {}

    def run(self, h: Array, q: Array, v: Array, u: Array, p: Array) -> Array:
        """States (ns, N + 1) after steps h (N,) with q, v, u (., N) held over each."""
        count = len(h)
        if not len(self.start):
            return np.empty((0, count + 1))
        if count not in self._runs:
            self._runs[count] = self._step.mapaccum(count)
        held = np.repeat(p[:, None], count, axis=1)
        answer = self._runs[count](self.start, h[None, :], q, v, u, held)
        return np.hstack([self.start[:, None], np.asarray(answer.full())])


def substeps(track: Track, delays: Array) -> tuple[Array, Array, Array]:
    """(times (N + 1,), valves (valves, N), index of each node) with a time at every switching.

    `delays` (valves, 2): seconds from the command to switching on and off. As many times come back
    whatever the delays are, so that functions built for one length serve them all.
    """
    events, signs = [], []
    for (times, change, _), (on, off) in zip(track.switches, delays, strict=True):
        events.append(times + np.where(change > 0, on, off))
        signs.append(change)
    first, last = track.time[0], track.time[-1]
    inner = [np.clip(e, first, last) for e in events]
    everything = np.concatenate([track.time, *inner])
    order = np.argsort(everything, kind="stable")
    times = everything[order]
    index = np.empty(len(order), int)
    index[order] = np.arange(len(order))
    middle = 0.5 * (times[1:] + times[:-1])
    valves = np.zeros((len(events), len(middle)))
    for i, (event, sign) in enumerate(zip(events, signs, strict=True)):
        sorted_by = np.argsort(event, kind="stable")
        count = np.concatenate([[0.0], np.cumsum(sign[sorted_by])]) + track.switches[i][2]
        valves[i] = count[np.searchsorted(event[sorted_by], middle, side="right")] > 0.5
    return times, valves, index[: len(track.time)]
