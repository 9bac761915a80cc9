"""The input vector of a model over time: profiles, feedback, and the times at which it jumps."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from kemba.errors import KembaError, suggest
from kemba.model import Model
from kemba.plant.simulation.commands import SAME_TIME, Commands, Feedback, Profile, Sense
from kemba.plant.stepping.arrays import Array


class Inputs:
    """Values u (nu,) of a model's inputs in their order, held between `breaks`.

    `acting` are the profiles as they reach the model; `sent` (nu,) are the values as commanded,
    which a log shows.
    """

    def __init__(self, model: Model, commands: Commands, acting: Mapping[str, Profile]) -> None:
        self.names = [quantity.name for quantity in model.inputs.values()]
        for name in commands.profiles:
            if name not in self.names:
                raise KembaError(model.name, f"no input '{name}'", hint=suggest(name, self.names))
        self.profiles, self.commanded = dict(acting), dict(commands.profiles)
        self.feedback = commands.feedback
        self.period, self._tick = commands.period, 0
        self.u = np.zeros(len(self.names))

    def breaks(self, duration: float) -> Array:
        """Times in (0, duration) [s] at which an input may jump."""
        times = [p.times for p in (*self.profiles.values(), *self.commanded.values())]
        if self.feedback:
            times.append(np.arange(1, int(duration / self.period) + 1) * self.period)
        found = np.concatenate([np.empty(0), *times])
        return np.unique(found[(found > SAME_TIME) & (found < duration - SAME_TIME)])

    def update(self, time: float, sense: Sense) -> Array:
        """The inputs from `time` [s] on; the controller is asked when its tick has come."""
        u: Array = self.u.copy()
        for name, profile in self.profiles.items():
            u[self.names.index(name)] = profile(time)
        if self.feedback and time >= self._tick * self.period - SAME_TIME:
            self._ask(self.feedback, time, sense, u)
            self._tick += 1
        self.u = u
        return u

    def sent(self, time: float) -> Array:
        """The inputs as commanded at `time` [s]."""
        u: Array = self.u.copy()
        for name, profile in self.commanded.items():
            u[self.names.index(name)] = profile(time)
        return u

    def _ask(self, feedback: Feedback, time: float, sense: Sense, u: Array) -> None:
        for name, value in feedback(time, sense).items():
            if name not in self.names:
                raise KembaError("feedback", f"no input '{name}'", hint=suggest(name, self.names))
            u[self.names.index(name)] = value


def merged(*times: Array) -> Array:
    """All the times in order, those closer than `SAME_TIME` as one."""
    every = np.unique(np.concatenate(times))
    return every[np.r_[True, np.diff(every) > SAME_TIME]] if len(every) else every
