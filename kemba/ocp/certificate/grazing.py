"""Feet that graze the ground: they touch for a moment and leave again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kemba.events import LASTS, PLANNED, read
from kemba.trajectory import Trajectory


@dataclass(frozen=True)
class Graze:
    """A foot that touches at a time [s] for a `duration` [s] and leaves again."""

    foot: str
    time: float
    duration: float

    @property
    def sentence(self) -> str:
        """What happens, in words."""
        lasts = f"{1e3 * self.duration:.0f} ms"
        return f"{self.foot} touches the ground for {lasts} at {self.time:.3f} s and leaves again"


def grazes(plan: Trajectory, euler: bool = False) -> list[Graze]:
    """The short contacts of a plan's feet between two times in the air.

    `euler`: the plan is an implicit Euler one, whose ground pushes in the whole step before the
    first row at which a foot is down.
    """
    found = []
    for leg, spans in read(plan, PLANNED).contacts.items():
        for span in (s for s in spans if not s.firm):
            row = int(np.searchsorted(plan.time, span.begin))
            begin = float(plan.time[row - 1]) if euler else span.begin
            if span.end - begin < LASTS:
                found.append(Graze(f"{leg}/foot", begin, span.end - begin))
    return found
