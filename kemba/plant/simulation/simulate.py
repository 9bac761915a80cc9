"""Simulating a model: from initial values and commands to a trajectory."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from kemba.errors import KembaError
from kemba.model import Model
from kemba.plant.simulation.commands import SAME_TIME, Commands
from kemba.plant.simulation.record import Impact
from kemba.plant.simulation.start import initial_values
from kemba.plant.simulation.valves import delayed
from kemba.plant.stepping.arrays import Array
from kemba.plant.stepping.equations import equations_of
from kemba.trajectory import Trajectory

STEP, LONGEST = 1e-4, 5e-4  # s


@dataclass(frozen=True)
class Simulated:
    """A simulated motion, and the impacts on the way."""

    trajectory: Trajectory
    impacts: tuple[Impact, ...]


def simulate(
    model: Model,
    initial: Mapping[str, float] | None = None,
    commands: Commands | None = None,
    duration: float = 1.0,
    step: float = STEP,
    sample: float | Array = 1e-3,
    dead_time: bool = True,
) -> Trajectory:
    """The motion of `model` for `duration` [s] with every output, state, input and force.

    `initial`: coordinates, velocities and effect states by column name; the standing pose at rest
    stands for what is missing. `step` [s] is the longest step; valve switchings, controller
    ticks and impacts end steps exactly. `sample` [s], or the times themselves (m,). `dead_time`:
    valves act later than sent, by the model's own timing; their columns show them as sent.
    Values at a sample hold just after it.
    Raises KembaError on unknown names and on models without free motion.
    """
    return run(model, initial, commands, duration, step, sample, dead_time).trajectory


def run(
    model: Model,
    initial: Mapping[str, float] | None = None,
    commands: Commands | None = None,
    duration: float = 1.0,
    step: float = STEP,
    sample: float | Array = 1e-3,
    dead_time: bool = True,
) -> Simulated:
    """As `simulate`, with the impacts that happened."""
    from kemba.plant.simulation.player import Player  # numba takes half a second to import
    from kemba.plant.simulation.record import trajectory

    if model.mechanism.imposed:
        raise KembaError(model.name, "its motion is imposed", hint="use kemba.plant.rig.rigs")
    if not 0.0 < step <= LONGEST:
        expected = f"up to {LONGEST:g} s was expected"
        raise KembaError("step", f"{step:g} s is out of range", expected)
    commands = commands or Commands()
    profiles = dict(commands.profiles)
    acting = delayed(model, profiles) if dead_time else profiles
    times, equations = _samples(duration, sample), equations_of(model)
    start = initial_values(model, initial or {})
    player = Player(model, equations, start, commands, acting, times, duration)
    player.play(step)
    motion = trajectory(model, equations, player.times, player.table)
    return Simulated(motion, tuple(player.impacts))


def _samples(duration: float, sample: float | Array) -> Array:
    if np.ndim(sample):
        return np.asarray(sample, dtype=float)
    times = np.arange(int(duration / float(sample) + 1e-6) + 1) * float(sample)
    if duration - times[-1] > SAME_TIME:
        return np.append(times, duration)
    return np.append(times[:-1], duration)
