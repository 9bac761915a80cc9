"""What happens along an executed table, linearised, and the maps through it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kemba.policy.modes import Array, Hybrid
from kemba.trajectory import Trajectory


@dataclass(frozen=True)
class Flow:
    """A stretch of time in one mode: when it begins and ends [s], its map of (x, torques)."""

    begin: float
    end: float
    map: Array  # (n + m, n + m)


@dataclass(frozen=True)
class Tick:
    """The controller acts: torques = hold (m, n) x + what a policy adds. `tick`: its row."""

    time: float
    tick: int
    hold: Array


@dataclass(frozen=True)
class Edge:
    """A valve switches: `late` (n,) is the change of x per second by which it comes later.

    `valve`: its column; `index`: which of its edges; `sent`: the tick at which it is sent.
    """

    time: float
    valve: str
    index: int
    sent: int
    late: Array


@dataclass(frozen=True)
class Saltation:
    """A touchdown or a stop: the saltation matrix (n, n)."""

    time: float
    saltation: Array


Event = Flow | Tick | Edge | Saltation


@dataclass(frozen=True)
class EventCourse:
    """An executed table and its events in order; `motion` has a row at every tick."""

    hybrid: Hybrid
    table: Trajectory
    motion: Trajectory
    states: Array  # (ticks, n)
    events: tuple[Event, ...]
    joints: tuple[str, ...]

    def map(self, begin: float, end: float) -> Array:
        """The slope (n, n) of the state at `end` [s] by the state at `begin` [s], no policy."""
        n, m = self.hybrid.size, len(self.joints)
        found = np.eye(n + m)
        for event in self.events:
            time = event.begin if isinstance(event, Flow) else event.time
            if begin - 1e-9 <= time < end - 1e-9:
                found = plain(event, n, m) @ found
        return found[:n, :n]


def plain(event: Event, n: int, m: int) -> Array:
    """The map of (x, torques) through an event without a policy."""
    whole = np.eye(n + m)
    if isinstance(event, Flow):
        return event.map
    if isinstance(event, Tick):
        whole[n:, :n], whole[n:, n:] = event.hold, 0.0
    elif isinstance(event, Saltation):
        whole[:n, :n] = event.saltation
    return whole
