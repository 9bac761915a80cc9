"""What a simulation is told to do: commands over time, valves, inputs of the kernel."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from kemba.effects.pneumatics import switching
from kemba.errors import KembaError, suggest
from kemba.model import Model
from kemba.plant.kernel.machine import Array
from kemba.trajectory import SAME_TIME, Trajectory

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
        return np.asarray(self.values[np.maximum(index, 0)])


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
        return np.asarray(self.wanted[np.clip(index, 0, len(self.times) - 1)])


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


def input_names(model: Model) -> list[str]:
    """The columns of a model's inputs in the order of u."""
    return [quantity.name for quantity in model.inputs.values()]


def find_input(model: Model, name: str, where: str) -> int:
    """The place of an input in u. Raises KembaError, blaming `where`."""
    names = input_names(model)
    if name not in names:
        raise KembaError(where, f"no input '{name}'", hint=suggest(name, names))
    return names.index(name)


def input_table(model: Model, profiles: Mapping[str, Profile], times: Array) -> Array:
    """Values (m, nu) from each of `times` (m,) [s] on; NaN where no profile says them. Raises
    KembaError on unknown names."""
    table = np.full((len(times), len(model.inputs)), np.nan)
    for name, profile in profiles.items():
        table[:, find_input(model, name, model.name)] = profile.at(times)
    return table


def breaks(profiles: Iterable[Profile], begin: float, end: float) -> Array:
    """Times between `begin` and `end` [s] at which a profile may jump."""
    found = np.concatenate([np.empty(0), *(p.times for p in profiles)])
    return np.unique(found[(found > begin + SAME_TIME) & (found < end - SAME_TIME)])


def ticks(commands: Commands, duration: float) -> Array:
    """Times from 0 to `duration` [s], both excluded, at which the feedback acts."""
    if commands.feedback is None:
        return np.empty(0)
    times = np.arange(1, int(duration / commands.period) + 1) * commands.period
    return times[times < duration - SAME_TIME]


def merged(*times: Array) -> Array:
    """All the times (m,) [s] in order; those closer than `SAME_TIME` count once."""
    every = np.unique(np.concatenate(times))
    return every[np.r_[True, np.diff(every) > SAME_TIME]] if len(every) else every


def among(marks: Array, times: Array) -> Array:
    """Whether each of `marks` (m,) is one of `times`."""
    first, last = (np.searchsorted(times, marks + off) for off in (-SAME_TIME, SAME_TIME))
    return np.asarray(first < last)


def acting(sent: Profile, on: float, off: float) -> Profile:
    """The profile of a 0/1 valve that opens `on` and closes `off` [s] after the command.

    Pulses that overlap after the shift merge; those that vanish are dropped. A valve that is on
    before the first command stays on until its first closing.
    """
    late = switching.delayed(switching.pulses(sent.times, sent.values), on, off)
    return Profile.pulses(*((a, b) for a, b in late.tolist()))


def delayed(model: Model, profiles: dict[str, Profile]) -> dict[str, Profile]:
    """The profiles with every valve's switching times of the model applied."""
    late = dict(profiles)
    for (leg, _), quantity in model.inputs.items():
        if quantity.binary and quantity.name in profiles:
            late[quantity.name] = acting(profiles[quantity.name], *model.timing(leg))
    return late


def scattered(
    model: Model, table: Trajectory, sigma: float, rng: np.random.Generator
) -> dict[str, Profile]:
    """The valve commands of a controller table, every switching moved by chance (`sigma` [s])."""
    moved = {}
    for quantity in model.inputs.values():
        if quantity.binary:
            profile = Profile.of(table.time, table[quantity.name]).from_closed()
            times = profile.times.copy()
            times[1:] += rng.normal(0.0, sigma, len(times) - 1)
            moved[quantity.name] = replace(profile, times=np.maximum.accumulate(times))
    return moved
