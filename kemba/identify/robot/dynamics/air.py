"""Effect states along measured motion: chambers, hoses, supply, motors; exact switching."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

from kemba.effects.pneumatics.switching import delayed, instants, is_on
from kemba.identify.problem.types import Array
from kemba.identify.robot.motion.resampled import ResampledLog
from kemba.machine_code import Native
from kemba.model.exponential import midpoint_step
from kemba.model.rest import Rest
from kemba.quantity import Quantity

Index = np.ndarray[Any, np.dtype[np.int_]]


class StateRunner:
    """Integrates s' = rate(q, v, s, u, p) for given motion, from rest at its first place."""

    def __init__(self, symbols: list[ca.SX], rate: ca.SX, quantities: Sequence[Quantity]) -> None:
        q, v, s, u, p = symbols
        self.count = s.numel()
        if not self.count:
            return
        self._rest = Rest(s, [q, v, u, p], rate, quantities)
        self._symbols, self._rate = symbols, rate
        self._codes: dict[bytes, Native] = {}

    def run(
        self, h: Array, q: Array, v: Array, u: Array, p: Array, among: Index | None = None
    ) -> Array:
        """Mean of the states (N, ns) over steps h (N,) with q, v, u (N, .) held over each.

        `among`: states that are asked for, and that depend on no others (None: all); the others
        stay at rest.
        """
        count = len(h)
        if not self.count:
            return np.empty((count, 0))
        own = np.arange(self.count) if among is None else among
        rest, ns = self._rest(q[0], 0.0 * v[0], u[0], p), len(own)
        same = np.broadcast_to(p, (count, len(p)))
        given = np.hstack([h[:, None], q, v, u, same])
        x = np.zeros((count + 1, ns + given.shape[1]))
        x[:-1, ns:] = given
        x[0, :ns] = rest[own]
        means = np.zeros((count, ns))
        # each step begins where the one before has ended
        self._code(own).rows("step", x[:-1], x[1:, :ns], means)
        whole = np.tile(rest, (count, 1))
        whole[:, own] = means
        return whole

    def _code(self, own: Index) -> Native:
        """A step of these states."""
        key = own.tobytes()
        if key not in self._codes:
            q, v, s, u, p = self._symbols
            h, held = ca.SX.sym("h"), [q, v, u, p]
            at = own.tolist()
            step = midpoint_step(self._rate[at], s[at], held, held, h)
            self._codes[key] = Native([s[at], h, *held], {"step": step})
        return self._codes[key]


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
