"""What is sent to the plant: piecewise constant profiles and feedback at a fixed rate."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from kemba.plant.stepping.arrays import Array

SAME_TIME = 1e-9  # s; times closer than this are one

Sense = Mapping[str, float]
Feedback = Callable[[float, Sense], Mapping[str, float]]


@dataclass(frozen=True)
class Profile:
    """A piecewise constant signal: `values[i]` from `times[i]` [s] on, `values[0]` before."""

    times: Array
    values: Array

    @classmethod
    def of(cls, times: Any, values: Any) -> Profile:
        """The profile of samples, with repeated values dropped."""
        times, values = np.asarray(times, dtype=float), np.asarray(values, dtype=float)
        kept = np.r_[True, np.diff(values) != 0.0]
        return cls(times[kept], values[kept])

    @classmethod
    def constant(cls, value: float) -> Profile:
        return cls(np.zeros(1), np.array([value]))

    @classmethod
    def pulses(cls, *pulses: tuple[float, float]) -> Profile:
        """A valve that is on from a to b [s] for every pulse (a, b)."""
        rows = [(-np.inf, 0.0)]
        for start, end in pulses:
            rows += [(start, 1.0), (end, 0.0)]
        times, values = np.array([r for r in rows if r[0] < np.inf], dtype=float).T
        return cls(times, values)

    def __call__(self, time: float) -> float:
        index = int(np.searchsorted(self.times, time + SAME_TIME, side="right")) - 1
        return float(self.values[max(index, 0)])


@dataclass(frozen=True)
class Commands:
    """Inputs of the plant by column name; those not named stay 0.

    `profiles`: signals known beforehand, valves as sent to the solenoids. `feedback(time, sense)`
    is asked every `period` [s] for inputs that answer to the motion and holds them in between;
    `sense` holds coordinates, velocities and effect states by name.
    """

    profiles: Mapping[str, Profile] = field(default_factory=dict)
    feedback: Feedback | None = None
    period: float = 1e-3
