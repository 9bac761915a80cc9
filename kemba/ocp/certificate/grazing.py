"""Feet that graze the ground: they touch for a moment and leave again."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from kemba.scene import above_ground
from kemba.trajectory import Trajectory

LASTS = 0.02  # s; a shorter contact between two times in the air does not carry the robot
TOUCHES = 1e-5  # m; planned feet below this touch


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
    for foot, height in above_ground(plan).items():
        down = height <= TOUCHES
        change = np.flatnonzero(np.diff(down.astype(int)))  # the last row before each change
        for before, last in itertools.pairwise(change):
            begin = float(plan.time[before if euler else before + 1])
            lasts = float(plan.time[last]) - begin
            if down[last] and lasts < LASTS:
                found.append(Graze(foot, begin, lasts))
    return found
