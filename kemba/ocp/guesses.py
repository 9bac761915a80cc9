"""Guesses from which a plan is sought, in the order in which they are tried."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from kemba.model import Model
from kemba.ocp.task.task import Task

# noise of a further guess, of every scale: enough for another plan, too little for a strange one
NOISE = 0.05
OTHERS = 2  # further guesses at most: each costs as much as the first


@dataclass(frozen=True)
class StartGuess:
    """A start guess with `noise` drawn by `seed`, and the shortest `pulse` [s] of a valve that is
    sought from it."""

    pulse: float
    noise: float
    seed: int

    @property
    def update(self) -> dict[str, Any]:
        """What a task has instead, so that it begins here."""
        return {"guess_noise": self.noise, "seed": self.seed}


def guesses(task: Task, model: Model) -> Sequence[StartGuess]:
    """The guesses of a task.

    A relaxed valve is open in part; rounded on a grid it opens and closes from node to node. Pulses
    that are shorter than the filling of a chamber move the leg little, and plans with many of them
    have no neighbours without. So they are left out first, and taken only where that gives no plan.
    """
    fill = max(model.mechanism.need_cylinder().fill)
    longer = max(fill, task.min_dwell)
    found = [StartGuess(pulse, task.guess_noise, task.seed) for pulse in (longer, task.min_dwell)]
    noise = max(task.guess_noise, NOISE)
    found += [StartGuess(longer, noise, task.seed + k) for k in range(1, OTHERS + 1)]
    return list(dict.fromkeys(found))
