"""Valve edges on the controller's ticks, one after the other, so that impulses keep."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, floor

SNAP = 1e-6  # ticks; an edge this near to a tick is on it


@dataclass(frozen=True)
class ValveEdges:
    """A valve's edges in ticks, ascending, the first one opens. `leg`: the one it drives; `force`:
    the way it pushes, +1 or -1."""

    edges: Sequence[float]
    leg: int
    force: float


def rounded(valves: Sequence[ValveEdges]) -> list[list[int]]:
    """The tick of every edge of every valve: as a rule the one before or the one after it.

    An edge that comes a tick late adds or takes one tick of its chamber's force. In order of time,
    each goes to the tick after which its leg has been pushed too much by the least impulse (error
    feedback): so pulses and gaps keep their lengths, and a chamber on one side of a piston makes up
    for the other. Edges keep their order, also between valves, and those of one valve stay a tick
    apart.
    """
    wanted = [_apart(valve.edges) for valve in valves]
    order = sorted((time, v, k) for v, edges in enumerate(wanted) for k, time in enumerate(edges))
    ticks: list[list[int]] = [[] for _ in valves]
    excess = dict.fromkeys((valve.leg for valve in valves), 0.0)  # impulse, in ticks of a chamber
    earlier, before, latest = -1, -1.0, -1  # latest tick of the times before this one, this one
    for time, v, k in order:
        if time > before + SNAP:
            earlier, before = max(earlier, latest), time
        sign = valves[v].force * (-1.0 if k % 2 == 0 else 1.0)  # opening late takes, closing adds
        low = max(earlier, ticks[v][-1] + 1 if ticks[v] else 0)
        around = {max(low, floor(time + SNAP)), max(low, ceil(time - SNAP))}
        leg = valves[v].leg
        errors = {tick: excess[leg] + sign * (tick - time) for tick in sorted(around)}
        tick = min(errors, key=lambda t: (round(abs(errors[t]), 6), abs(t - time)))
        excess[leg] = errors[tick]
        ticks[v].append(tick)
        latest = max(latest, tick)
    return ticks


def _apart(edges: Sequence[float]) -> list[float]:
    """The edges of a valve, each at least a tick after the one before."""
    found: list[float] = []
    for time in edges:
        found.append(max(time, found[-1] + 1.0) if found else time)
    return found
