"""Simulating a model: from initial values and commands to a trajectory."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from kemba.errors import KembaError
from kemba.model import Model
from kemba.plant.kernel.settings import StepLength
from kemba.plant.simulation.commands import SAME_TIME, Commands
from kemba.plant.simulation.record import Impact, trajectory
from kemba.plant.simulation.start import initial_values
from kemba.plant.simulation.valves import delayed
from kemba.plant.stepping.arrays import Array
from kemba.plant.stepping.family import equations_of, share_equations
from kemba.trajectory import Trajectory

if TYPE_CHECKING:
    from kemba.plant.simulation.player import Player


@dataclass(frozen=True)
class Simulated:
    """A simulated motion, and the impacts on the way."""

    trajectory: Trajectory
    impacts: tuple[Impact, ...]


@dataclass(frozen=True)
class Condition:
    """One of many simulations: the arguments of `simulate`."""

    model: Model
    initial: Mapping[str, float] | None = None
    commands: Commands | None = None
    duration: float = 1.0
    step: float | None = None
    sample: float | Array = 1e-3
    dead_time: bool = True


def simulate(
    model: Model,
    initial: Mapping[str, float] | None = None,
    commands: Commands | None = None,
    duration: float = 1.0,
    step: float | None = None,
    sample: float | Array = 1e-3,
    dead_time: bool = True,
) -> Trajectory:
    """The motion of `model` for `duration` [s] with every output, state, input and force.

    `initial`: coordinates, velocities and effect states by column name; the standing pose at rest
    stands for what is missing. Steps are as long as the motion allows; `step` [s] makes them equal
    and no longer than that. Valve switchings, controller ticks and impacts end steps exactly.
    `sample` [s], or the times themselves (m,). `dead_time`: valves act later than sent, by the
    model's own timing; their columns show them as sent. Values at a sample hold just after it.
    Raises KembaError on unknown names and on models without free motion.
    """
    return run(model, initial, commands, duration, step, sample, dead_time).trajectory


def run(
    model: Model,
    initial: Mapping[str, float] | None = None,
    commands: Commands | None = None,
    duration: float = 1.0,
    step: float | None = None,
    sample: float | Array = 1e-3,
    dead_time: bool = True,
) -> Simulated:
    """As `simulate`, with the impacts that happened; `sample` [s] or the times (m,)."""
    condition = Condition(model, initial, commands, duration, step, sample, dead_time)
    return simulate_one(condition)


def simulate_one(condition: Condition) -> Simulated:
    """The simulation that a condition describes. Raises KembaError as `simulate` does."""
    return _played(_player(condition), condition)


def run_many(
    conditions: Iterable[Condition], jobs: int | None = None
) -> list[Simulated | KembaError]:
    """Many simulations side by side on `jobs` cores (all of them), in the order given.

    Models that differ in numbers only, as `Model.with_effects` makes them, share their machine
    code. A simulation that fails gives its error; the others go on. Raises KembaError as
    `simulate` does where a condition makes no sense.
    """
    conditions = list(conditions)
    share_equations(condition.model for condition in conditions)
    with ThreadPoolExecutor(jobs or os.cpu_count()) as pool:
        waiting = [pool.submit(_tried, _player(c), c) for c in conditions]
        return [future.result() for future in waiting]


def _tried(player: Player, condition: Condition) -> Simulated | KembaError:
    try:
        return _played(player, condition)
    except KembaError as error:
        return error


SHORT = 1e-4  # s; as long as the shortest steps that plants are tested with


def _player(condition: Condition) -> Player:
    from kemba.plant.simulation.player import Player  # numba takes half a second to import

    model, step = condition.model, condition.step
    if model.mechanism.imposed:
        raise KembaError(model.name, "its motion is imposed", hint="use kemba.plant.rig.rigs")
    longest = StepLength.current().longest  # longer ones of equal length would miss events, too
    if step is not None and not 0.0 < step <= longest:
        expected = f"up to {longest:g} s was expected"
        raise KembaError("step", f"{step:g} s is out of range", expected)
    commands = condition.commands or Commands()
    profiles = dict(commands.profiles)
    acting = delayed(model, profiles) if condition.dead_time else profiles
    start = initial_values(model, condition.initial or {})
    samples = _samples(condition.duration, condition.sample)
    equations = equations_of(model)
    return Player(model, equations, start, commands, acting, samples, condition.duration)


def _played(player: Player, condition: Condition) -> Simulated:
    try:
        player.play(condition.step)
    except KembaError:
        # a long step may land where no contact forces fit; short ones of equal length tell
        if condition.step is not None:
            raise
        player = _player(condition)
        player.play(SHORT)
    motion = trajectory(player.model, player.equations, player.times, player.table)
    return Simulated(motion, tuple(player.impacts))


def _samples(duration: float, sample: float | Array) -> Array:
    if np.ndim(sample):
        return np.asarray(sample, dtype=float)
    times = np.arange(int(duration / float(sample) + 1e-6) + 1) * float(sample)
    if duration - times[-1] > SAME_TIME:
        return np.append(times, duration)
    return np.append(times[:-1], duration)
