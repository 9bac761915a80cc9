"""Effect states along measured motion: chambers, hoses, supply, motors; exact switching."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from kemba.identify.robot.motion.resampled import ResampledLog
from kemba.settings import Settings, setting

Array = np.ndarray[Any, np.dtype[np.float64]]
Index = np.ndarray[Any, np.dtype[np.int_]]


class SettlingSettings(Settings):
    """How the chambers settle at the first command before a log starts."""

    count: int = setting(
        40, "1", "number of steps", "derived: 0.4 s, ten times the slowest rise time of Table I"
    )
    step: float = setting(
        0.01, "s", "length of a step", "convention: the integration is exact for lags"
    )

    @property
    def steps(self) -> Array:
        """All steps (count,) [s]."""
        return np.full(self.count, self.step)


class StateRunner:
    """Integrates s' = rate(q, v, s, u, p) for given motion.

    Exponential midpoint rule: second order, exact for a lag of constant input however short.
    """

    def __init__(self, symbols: list[ca.SX], rate: ca.SX, start: Array) -> None:
        q, v, s, u, p = symbols
        self.start = start
        if not s.numel():
            return
        h = ca.SX.sym("h")
        f = ca.Function("f", [q, v, s, u, p], [rate, ca.diag(ca.jacobian(rate, s))])
        middle = s + _grown(h / 2, *f(q, v, s, u, p))
        slope, stiff = f(q, v, middle, u, p)
        slope = slope - stiff * (middle - s)
        after, mean = s + _grown(h, slope, stiff), s + _mean_growth(h, slope, stiff)
        self._step = ca.Function("step", [s, h, q, v, u, p], [after, mean], {"cse": True})
        self._runs: dict[int, ca.Function] = {}

    def run(self, h: ca.DM, q: ca.DM, v: ca.DM, u: ca.DM, p: Array) -> Array:
        """Mean of the states (ns, N) over steps h (1, N) with q, v, u (., N) held over each."""
        count = h.shape[1]
        if not len(self.start):
            return np.empty((0, count))
        if count not in self._runs:
            whole = self._step.mapaccum(count)
            args = [ca.MX.sym(f"i{i}", *whole.size_in(i)) for i in range(5)]
            one = ca.MX.sym("p", self._step.size1_in(5))
            means = whole(*args, ca.repmat(one, 1, count))[1]
            self._runs[count] = ca.Function("means", [*args, one], [means])
        return np.asarray(self._runs[count](self.start, h, q, v, u, p).full())


def _grown(h: ca.SX, slope: ca.SX, stiff: ca.SX) -> ca.SX:
    """h phi(h stiff) slope with phi(z) = (exp(z) - 1)/z."""
    z = h * stiff
    small = ca.fabs(z) < 1e-6
    return h * slope * ca.if_else(small, 1 + z / 2, (ca.exp(z) - 1) / ca.if_else(small, 1, z))


def _mean_growth(h: ca.SX, slope: ca.SX, stiff: ca.SX) -> ca.SX:
    """Mean of the growth over the step: h slope (exp(z) - 1 - z)/z^2."""
    z = h * stiff
    small = ca.fabs(z) < 1e-3
    safe = ca.if_else(small, 1, z)
    return h * slope * ca.if_else(small, 0.5 + z / 6, (ca.exp(z) - 1 - z) / safe**2)


def substeps(log: ResampledLog, delays: Array) -> tuple[Array, Array, Index]:
    """(times (N + 1,), valves (valves, N), index of each node) with a time at every switching.

    `delays` (valves, 2): seconds from the command to switching on and off. As many times come back
    whatever the delays are, so that functions built for one length serve them all.
    """
    events, signs = [], []
    for (times, change, _), (on, off) in zip(log.switches, delays, strict=True):
        events.append(times + np.where(change > 0, on, off))
        signs.append(change)
    first, last = log.time[0], log.time[-1]
    inner = [np.clip(e, first, last) for e in events]
    everything = np.concatenate([log.time, *inner])
    order = np.argsort(everything, kind="stable")
    times = everything[order]
    index = np.empty(len(order), int)
    index[order] = np.arange(len(order))
    middle = 0.5 * (times[1:] + times[:-1])
    valves = np.zeros((len(events), len(middle)))
    for i, (event, sign) in enumerate(zip(events, signs, strict=True)):
        sorted_by = np.argsort(event, kind="stable")
        count = np.concatenate([[0.0], np.cumsum(sign[sorted_by])]) + log.switches[i][2]
        valves[i] = count[np.searchsorted(event[sorted_by], middle, side="right")] > 0.5
    return times, valves, index[: len(log.time)]
