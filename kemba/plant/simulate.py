"""Simulating a model: from initial values and commands to a trajectory."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from kemba.errors import KembaError
from kemba.model import Model
from kemba.plant.arrays import Array
from kemba.plant.commands import SAME_TIME, Commands
from kemba.plant.equations import equations_of
from kemba.plant.events import Advance, Impact
from kemba.plant.inputs import Inputs, merged
from kemba.plant.recorder import Recorder
from kemba.plant.start import initial_values
from kemba.plant.valves import delayed
from kemba.trajectory import Trajectory

STEP, LONGEST = 1e-4, 5e-4  # s


@dataclass(frozen=True)
class Run:
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
) -> Run:
    """As `simulate`, with the impacts that happened."""
    if model.mechanism.imposed:
        raise KembaError(model.name, "its motion is imposed", hint="use kemba.plant.rigs")
    if not 0.0 < step <= LONGEST:
        raise KembaError("step", f"{step:g} s is out of range", f"0 to {LONGEST:g} s was expected")
    commands = commands or Commands()
    times = _samples(duration, sample)
    profiles = dict(commands.profiles)
    inputs = Inputs(model, commands, delayed(model, profiles) if dead_time else profiles)
    advance = Advance(equations_of(model), step)
    recorder = Recorder(model, advance)
    senses = Senses(model)
    q, v, s = initial_values(model, initial or {})
    advance.u = inputs.update(0.0, senses.of(q, v, s))
    now = advance.begin(0.0, q, v, s)
    marks = merged(np.zeros(1), times, inputs.breaks(duration), np.array([duration]))
    sampled = np.searchsorted(times, marks - SAME_TIME) < np.searchsorted(times, marks + SAME_TIME)
    for until, wanted in zip(marks, sampled, strict=True):
        if until > 0.0:
            now = advance.to(now, float(until))
            advance.u = inputs.update(float(until), senses.of(now.q, now.v, now.s))
        if wanted:
            recorder.record(now, inputs.sent(now.time))
    return Run(recorder.trajectory(), tuple(advance.impacts))


class Senses:
    """What a controller sees: coordinates, velocities and effect states by name."""

    def __init__(self, model: Model) -> None:
        mechanism = model.mechanism
        listed = (*mechanism.coordinates, *mechanism.velocities, *model.states.values())
        self._names = [quantity.name for quantity in listed]

    def of(self, q: Array, v: Array, s: Array) -> dict[str, float]:
        return dict(zip(self._names, np.concatenate([q, v, s]).tolist(), strict=True))


def _samples(duration: float, sample: float | Array) -> Array:
    if np.ndim(sample):
        return np.asarray(sample, dtype=float)
    count = int(np.floor(duration / float(sample) + 1e-9))
    return np.append(np.arange(count) * float(sample), duration) if count else np.zeros(1)
