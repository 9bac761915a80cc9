"""The inputs of a model over time: when they jump, and their values from there."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from kemba.errors import KembaError, suggest
from kemba.model import Model
from kemba.plant.simulation.commands import SAME_TIME, Commands, Profile
from kemba.plant.stepping.arrays import Array


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
    """Values (m, nu) from each of `times` (m,) [s] on; NaN where no profile says them.

    Raises KembaError on unknown names.
    """
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
    found: Array = np.searchsorted(times, marks - SAME_TIME) < np.searchsorted(
        times, marks + SAME_TIME
    )
    return found
