"""Valve edges on the controller's ticks, all rounded together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, exp, floor

import numpy as np

# by hand on jump, jump_forward and max_jump, no benchmark
FORGET = 100.0  # ticks in which an impulse error fades; a stance lasts 100 to 300
MOVES = 20.0  # ticks: impulse errors that last shorter than a chamber's rise hardly count
SHIFT = 0.1  # weight of an edge's own error
SNAP = 1e-6  # ticks; an edge this near to a tick is on it
KEPT = 1000  # partial choices that are kept at each edge


@dataclass(frozen=True)
class ValveEdges:
    """A valve's edges in ticks, ascending, the first one opens. `body`: the leg it drives;
    `force`: the way it pushes, +1 or -1."""

    edges: Sequence[float]
    leg: int
    force: float


@dataclass(frozen=True)
class _Choices:
    """Ticks chosen so far (n, edges), their cost (n,), the latest tick of each valve (n, valves)
    and the impulse error of each leg (n, legs), in ticks of one chamber's force."""

    cost: np.ndarray
    ticks: np.ndarray
    latest: np.ndarray
    impulse: np.ndarray

    def lasting(self, time: float) -> _Choices:
        """The choices after `time` without an edge."""
        own = self.impulse**2
        i, j = np.triu_indices(self.impulse.shape[1], 1)
        turning = (self.impulse[:, i] - self.impulse[:, j]) ** 2
        spent = (1.0 - exp(-time / MOVES)) * (own.sum(axis=1) + turning.sum(axis=1))
        impulse = exp(-time / FORGET) * self.impulse
        return replace(self, cost=self.cost + spent, impulse=impulse)

    def of(self, which: np.ndarray) -> _Choices:
        """Some of the choices, by their indices or a mask."""
        found = (self.cost, self.ticks, self.latest, self.impulse)
        return _Choices(*(values[which] for values in found))

    def at(self, tick: int, valve: int, leg: int, pushed: float, cost: float) -> _Choices:
        """The choices with one more edge, of `valve`, that pushes a leg too much by `pushed`."""
        latest, impulse = self.latest.copy(), self.impulse.copy()
        latest[:, valve] = tick
        impulse[:, leg] += pushed
        ticks = np.column_stack([self.ticks, np.full(len(self.cost), tick)])
        return _Choices(self.cost + cost, ticks, latest, impulse)

    def best(self, kept: int) -> _Choices:
        """The cheapest of those that are alike in what is still to come, `kept` of them."""
        order = np.argsort(self.cost, kind="stable")
        alike = np.column_stack([self.latest, np.round(self.impulse, 3)])[order]
        first = np.unique(alike, axis=0, return_index=True)[1]
        return self.of(order[np.sort(first)[:kept]])


def rounded(valves: Sequence[ValveEdges]) -> list[list[int]]:
    """The tick of every edge of every valve: the one before or the one after it.

    Of these choices the one with the least sum of squares is sought, of

    - the error of each edge, with a small weight,
    - the impulse by which the table has pushed a leg too much so far: an edge that comes a tick
      late adds or takes one tick of its chamber's force. So pulses and gaps keep their lengths,
      and a chamber on one side of a piston makes up for the other. This makes the apex,
    - the difference of that impulse between each pair of legs. This turns the body.

    Impulses count by how long they last, and fade with exp(-t / 100 ms). Edges keep their order,
    also between valves, and those of one valve stay a tick apart. Edges are decided in order of
    time; the best partial choices are kept at each.
    """
    wanted = [_apart(valve.edges) for valve in valves]
    order = sorted((time, v, k) for v, edges in enumerate(wanted) for k, time in enumerate(edges))
    legs = 1 + max((valve.leg for valve in valves), default=0)
    none = np.zeros((1, 0), int), np.full((1, len(valves)), -1), np.zeros((1, legs))
    best, now = _Choices(np.zeros(1), *none), 0.0
    at = [-1.0] * len(valves)  # when the latest edge of each valve was wanted
    for time, v, k in order:
        sign = valves[v].force * (-1.0 if k % 2 == 0 else 1.0)  # opening late takes, closing adds
        earlier = [u for u, before in enumerate(at) if u == v or before < time - SNAP]
        waited = best.lasting(time - now)
        low = (waited.latest + (np.arange(len(valves)) == v))[:, earlier].max(axis=1)
        new = [
            waited.of(tick >= low).at(
                tick, v, valves[v].leg, sign * (tick - time), SHIFT * (tick - time) ** 2
            )
            for tick in sorted({floor(time + SNAP), ceil(time - SNAP)})
        ]
        best, now, at[v] = _joined(new).best(KEPT), time, time
    chosen = best.lasting(FORGET)
    ticks: list[list[int]] = [[0] * len(edges) for edges in wanted]
    for (_, v, k), tick in zip(order, chosen.ticks[np.argmin(chosen.cost)], strict=True):
        ticks[v][k] = int(tick)
    return ticks


def _joined(choices: Sequence[_Choices]) -> _Choices:
    return _Choices(
        np.concatenate([c.cost for c in choices]),
        np.concatenate([c.ticks for c in choices]),
        np.concatenate([c.latest for c in choices]),
        np.concatenate([c.impulse for c in choices]),
    )


def _apart(edges: Sequence[float]) -> list[float]:
    """The edges of a valve, each at least a tick after the one before."""
    found: list[float] = []
    for time in edges:
        found.append(max(time, found[-1] + 1.0) if found else time)
    return found
