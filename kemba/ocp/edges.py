"""Valve edges on the controller's ticks, all rounded together."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, exp, floor

MEMORY = 20.0  # ticks over which two valves answer for each other: a chamber fills in about 20 ms
SNAP = 1e-6  # ticks; an edge this near to a tick is on it

Edges = Sequence[float]


def rounded(valves: Sequence[Edges]) -> list[list[int]]:
    """The tick of every edge; `valves[v]` holds the edge times of valve v in ticks, ascending.

    Every edge goes to the tick before or after it. Of all these choices the one with the least sum
    of squares is taken, exactly:

    - the error of each edge,
    - the change of each pulse length and of each gap between pulses of one valve, which sets
      how much air goes in and out,
    - the change of the time between an edge and the latest edge of every other valve, because
      the net force of a leg and the torque on the body depend on it. This weighs
      exp(-t / 20 ms) for edges t apart: a chamber has forgotten older ones.

    Edges keep their order, also between valves; edges of one valve stay at least one tick apart.
    Edges are decided in order of time. What matters later is only the latest tick of each valve,
    so a dynamic programme over these is exact.
    """
    wanted = [_apart(edges) for edges in valves]
    order = sorted((time, v, k) for v, edges in enumerate(wanted) for k, time in enumerate(edges))
    at: list[float | None] = [None] * len(valves)  # latest edge of each valve, as wanted
    best: dict[tuple[int, ...], tuple[float, tuple[int, ...]]] = {(-1,) * len(valves): (0.0, ())}
    for time, v, _ in order:
        found: dict[tuple[int, ...], tuple[float, tuple[int, ...]]] = {}
        for latest, (cost, chosen) in best.items():
            for tick in sorted({floor(time + SNAP), ceil(time - SNAP)}):
                if tick < max(latest) or (tick == latest[v] and at[v] is not None):
                    continue
                more = cost + _cost(time, tick, v, at, latest)
                key = (*latest[:v], tick, *latest[v + 1 :])
                if key not in found or more < found[key][0] - SNAP:
                    found[key] = (more, (*chosen, tick))
        at[v], best = time, found
    chosen = min(best.values(), key=lambda choice: choice[0])[1]
    ticks = [[0] * len(edges) for edges in wanted]
    for (_, v, k), tick in zip(order, chosen, strict=True):
        ticks[v][k] = tick
    return ticks


def _apart(edges: Edges) -> list[float]:
    """The edges of a valve, each at least a tick after the one before."""
    found: list[float] = []
    for time in edges:
        found.append(max(time, found[-1] + 1.0) if found else time)
    return found


def _cost(
    time: float, tick: int, v: int, at: Sequence[float | None], latest: Sequence[int]
) -> float:
    """What this edge of valve v adds when it goes to `tick`."""
    error = tick - time
    total = error**2
    for u, (before, where) in enumerate(zip(at, latest, strict=True)):
        if before is not None:
            weight = 1.0 if u == v else exp(-(time - before) / MEMORY)
            total += weight * (error - (where - before)) ** 2
    return total
