"""Effect states along measured motion: chambers, hoses, supply, motors; exact switching."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

from kemba.effects.pneumatics.switching import delayed, instants, is_on
from kemba.identify.robot.motion.resampled import ResampledLog
from kemba.model.exponential import midpoint_step
from kemba.model.rest import Rest
from kemba.quantity import Quantity

Array = np.ndarray[Any, np.dtype[np.float64]]
Index = np.ndarray[Any, np.dtype[np.int_]]


class StateRunner:
    """Integrates s' = rate(q, v, s, u, p) for given motion, from rest at its first place."""

    def __init__(self, symbols: list[ca.SX], rate: ca.SX, quantities: Sequence[Quantity]) -> None:
        q, v, s, u, p = symbols
        self.count = s.numel()
        if not self.count:
            return
        self._rest = Rest(s, [q, v, u, p], rate, quantities)
        h = ca.SX.sym("h")
        held = [q, v, u, p]
        after, mean = midpoint_step(rate, s, held, held, h)
        self._step = ca.Function("step", [s, h, q, v, u, p], [after, mean], {"cse": True})
        self._runs: dict[int, ca.Function] = {}

    def run(self, h: ca.DM, q: ca.DM, v: ca.DM, u: ca.DM, p: Array) -> Array:
        """Mean of the states (ns, N) over steps h (1, N) with q, v, u (., N) held over each."""
        count = h.shape[1]
        if not self.count:
            return np.empty((0, count))
        start = self._rest(q[:, 0], 0.0 * v[:, 0], u[:, 0], p)
        if count not in self._runs:
            whole = self._step.mapaccum(count)
            args = [ca.MX.sym(f"i{i}", *whole.size_in(i)) for i in range(5)]
            one = ca.MX.sym("p", self._step.size1_in(5))
            means = whole(*args, ca.repmat(one, 1, count))[1]
            self._runs[count] = ca.Function("means", [*args, one], [means])
        return np.asarray(self._runs[count](start, h, q, v, u, p).full())


def substeps(log: ResampledLog, delays: Array) -> tuple[Array, Array, Index]:
    """(times (N + 1,), valves (valves, N), index of each node) with a time at every switching.

    `delays` (valves, 2): seconds from the command to switching on and off. As many times come back
    whatever the delays are, so that functions built for one length serve them all.
    """
    first, last = log.time[0], log.time[-1]
    events = [log.time]
    for sent, late in zip(log.sent, delays, strict=True):
        events.append(np.clip(instants(np.reshape(sent, (-1, 2)) + late), first, last))
    everything = np.concatenate(events)
    order = np.argsort(everything, kind="stable")
    times = everything[order]
    index = np.empty(len(order), int)
    index[order] = np.arange(len(order))
    middle = 0.5 * (times[1:] + times[:-1])
    acting = (delayed(sent, *late) for sent, late in zip(log.sent, delays, strict=True))
    valves = np.stack([is_on(pulses, middle) for pulses in acting])
    return times, valves, index[: len(log.time)]
