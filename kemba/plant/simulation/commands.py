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

    def from_closed(self) -> Profile:
        """The same signal, but 0 before `times[0]`: a valve is closed until its first command."""
        if not self.values[0]:
            return self
        return Profile(np.r_[-np.inf, self.times], np.r_[0.0, self.values])

    def __call__(self, time: float) -> float:
        return float(self.at(np.array(time)))

    def at(self, times: Array) -> Array:
        """The values at `times` (m,) [s]."""
        index = np.searchsorted(self.times, times + SAME_TIME, side="right") - 1
        found: Array = self.values[np.maximum(index, 0)]
        return found


@dataclass(frozen=True)
class JointControl:
    """tau = K_p (q_d - q) + K_d (w_d - w) + tau_ff of each of the `joints`, within what its motor
    gives (paper, eq. 10).

    A joint `front/hip` has the columns `front/hip/q`, `front/hip/w` and `front/hip/tau`. `wanted`
    (m, joints, 3): q_d [rad], w_d [rad/s] and tau_ff [N.m] from `times` (m,) [s] on. `limits`
    (joints, 3): peak torque [N.m], speed without load [rad/s] and the slope [N.m.s/rad] at which
    torque falls with speed; infinite where nothing limits.
    """

    joints: tuple[str, ...]
    times: Array
    wanted: Array
    limits: Array
    K_p: float
    K_d: float

    def at(self, times: Array) -> Array:
        """What is wanted at `times` (k,) [s]: (k, joints, 3)."""
        index = np.searchsorted(self.times, times + SAME_TIME) - 1
        found: Array = self.wanted[np.clip(index, 0, len(self.times) - 1)]
        return found


@dataclass(frozen=True)
class Commands:
    """Inputs of the plant by column name; those not named stay 0.

    `profiles`: signals known beforehand, valves as sent to the solenoids. `feedback` acts every
    `period` [s] on inputs that answer to the motion and holds them in between: a `JointControl`,
    or a function `feedback(time, sense)` of yours, where `sense` holds coordinates, velocities
    and effect states by name.
    """

    profiles: Mapping[str, Profile] = field(default_factory=dict)
    feedback: Feedback | JointControl | None = None
    period: float = 1e-3
