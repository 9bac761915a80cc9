"""Valve edges on the controller's ticks, all rounded together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import ceil, exp, floor

from kemba.settings import Settings, setting

BY_HAND = "tuned: by hand on jump, jump_forward and max_jump, no benchmark"


class EdgeSettings(Settings):
    """How valve edges are rounded to the ticks of the controller."""

    forget: float = setting(
        100.0, "ticks", "time in which an impulse error fades; a stance lasts 100 to 300", BY_HAND
    )
    moves: float = setting(
        20.0,
        "ticks",
        "impulse errors that last shorter hardly count",
        "derived: a chamber's rise time",
    )
    shift: float = setting(0.1, "1", "weight of an edge's own error", BY_HAND)
    snap: float = setting(
        1e-6, "ticks", "an edge this near to a tick is on it", "derived: rounding of times in s"
    )
    kept: int = setting(1000, "1", "partial choices that are kept at each edge", BY_HAND)


@dataclass(frozen=True)
class ValveEdges:
    """A valve's edges in ticks, ascending, the first one opens. `body`: the leg it drives;
    `force`: the way it pushes, +1 or -1."""

    edges: Sequence[float]
    leg: int
    force: float


@dataclass(frozen=True)
class _Choice:
    """Ticks chosen so far, their cost, the latest tick of each valve and the impulse error of each
    leg, in ticks of one chamber's force."""

    cost: float
    ticks: tuple[int, ...]
    latest: tuple[int, ...]
    impulse: tuple[float, ...]


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
    limits = EdgeSettings.current()
    wanted = [_apart(valve.edges) for valve in valves]
    order = sorted((time, v, k) for v, edges in enumerate(wanted) for k, time in enumerate(edges))
    legs = 1 + max((valve.leg for valve in valves), default=0)
    best, now = [_Choice(0.0, (), (-1,) * len(valves), (0.0,) * legs)], 0.0
    at = [-1.0] * len(valves)  # when the latest edge of each valve was wanted
    for time, v, k in order:
        sign = valves[v].force * (-1.0 if k % 2 == 0 else 1.0)  # opening late takes, closing adds
        earlier = [u for u, before in enumerate(at) if u == v or before < time - limits.snap]
        found: dict[tuple[tuple[int, ...], tuple[float, ...]], _Choice] = {}
        for choice in best:
            waited = _lasting(choice, time - now, limits)
            low = max(choice.latest[u] + (u == v) for u in earlier)
            for tick in sorted({floor(time + limits.snap), ceil(time - limits.snap)}):
                if tick >= low:
                    new = _with(waited, tick, v, valves[v].leg, tick - time, sign, limits.shift)
                    key = new.latest, tuple(round(p, 3) for p in new.impulse)
                    if key not in found or new.cost < found[key].cost:
                        found[key] = new
        best, now, at[v] = sorted(found.values(), key=lambda c: c.cost)[: limits.kept], time, time
    chosen = min((_lasting(choice, limits.forget, limits) for choice in best), key=lambda c: c.cost)
    ticks: list[list[int]] = [[0] * len(edges) for edges in wanted]
    for (_, v, k), tick in zip(order, chosen.ticks, strict=True):
        ticks[v][k] = tick
    return ticks


def _lasting(choice: _Choice, time: float, limits: EdgeSettings) -> _Choice:
    """The choice after `time` without an edge."""
    own = sum(p**2 for p in choice.impulse)
    turning = sum((p - q) ** 2 for p, q in combinations(choice.impulse, 2))
    cost = choice.cost + (1.0 - exp(-time / limits.moves)) * (own + turning)
    impulse = tuple(exp(-time / limits.forget) * p for p in choice.impulse)
    return replace(choice, cost=cost, impulse=impulse)


def _with(
    choice: _Choice, tick: int, v: int, leg: int, error: float, sign: float, shift: float
) -> _Choice:
    """The choice with one more edge, of valve v, at `tick`."""
    impulse, latest = list(choice.impulse), list(choice.latest)
    impulse[leg] += sign * error
    latest[v] = tick
    cost = choice.cost + shift * error**2
    return _Choice(cost, (*choice.ticks, tick), tuple(latest), tuple(impulse))


def _apart(edges: Sequence[float]) -> list[float]:
    """The edges of a valve, each at least a tick after the one before."""
    found: list[float] = []
    for time in edges:
        found.append(max(time, found[-1] + 1.0) if found else time)
    return found
