"""Simulating a model: from initial values and commands to a trajectory."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from kemba.errors import KembaError
from kemba.model import Model
from kemba.plant.simulation.commands import SAME_TIME, Commands
from kemba.plant.simulation.inputs import Inputs, merged
from kemba.plant.simulation.recorder import Recorder
from kemba.plant.simulation.start import initial_values
from kemba.plant.simulation.valves import delayed
from kemba.plant.stepping.arrays import Array
from kemba.plant.stepping.equations import equations_of
from kemba.plant.stepping.events import Advance, Impact
from kemba.plant.stepping.lcp import NoSolutionError
from kemba.trajectory import Trajectory

STEP, LONGEST = 1e-4, 5e-4  # s
DEEP = 5e-3  # m; what starts deeper in the ground or a stop is a mistake
SMALLER = "try a smaller step, or look for a start that is impossible"


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
    times = _samples(duration, sample)
    simulation = Simulation(model, commands or Commands(), step, dead_time)
    simulation.begin(initial or {})
    breaks = simulation.inputs.breaks(duration)
    marks = merged(np.zeros(1), times, breaks, np.array([duration]))
    sampled = np.searchsorted(times, marks - SAME_TIME) < np.searchsorted(times, marks + SAME_TIME)
    for until, wanted in zip(marks, sampled, strict=True):
        if until > 0.0:
            simulation.to(float(until))
        if wanted:
            simulation.record()
    return Simulated(simulation.recorder.trajectory(), tuple(simulation.advance.impacts))


class Simulation:
    """A model on its way, between times at which its inputs may jump."""

    def __init__(self, model: Model, commands: Commands, step: float, dead_time: bool) -> None:
        if model.mechanism.imposed:
            raise KembaError(model.name, "its motion is imposed", hint="use kemba.plant.rig.rigs")
        if not 0.0 < step <= LONGEST:
            expected = f"up to {LONGEST:g} s was expected"
            raise KembaError("step", f"{step:g} s is out of range", expected)
        profiles = dict(commands.profiles)
        acting = delayed(model, profiles) if dead_time else profiles
        self.model = model
        self.inputs = Inputs(model, commands, acting)
        self.advance = Advance(equations_of(model), step)
        self.recorder = Recorder(model, self.advance)
        mechanism = model.mechanism
        sensed = (*mechanism.coordinates, *mechanism.velocities, *model.states.values())
        self._sensed = [quantity.name for quantity in sensed]

    def begin(self, initial: Mapping[str, float]) -> None:
        """Start from the values by column name. Raises KembaError where they make no sense."""
        q, v, s = initial_values(self.model, initial)
        self.advance.u = self.inputs.update(0.0, self._sense(q, v, s))
        self.now = self.advance.begin(0.0, q, v, s)
        for row, gap in zip(self.advance.eq.pairs.gaps, self.now.gap, strict=True):
            if gap < -DEEP:
                label = self.advance.eq.pairs.labels[row]
                raise KembaError("initial", f"{label} starts {-1e3 * gap:.1f} mm too deep")

    def to(self, until: float) -> None:
        """Go on to `until` [s] and take the inputs that hold from there."""
        try:
            self.now = self.advance.to(self.now, until)
        except NoSolutionError as error:
            raise KembaError(self.model.name, f"{error} at {until:.4f} s", hint=SMALLER) from None
        now = self.now
        if not np.isfinite(now.v).all():
            raise KembaError(self.model.name, f"the motion explodes at {until:.4f} s", hint=SMALLER)
        self.advance.u = self.inputs.update(until, self._sense(now.q, now.v, now.s))

    def record(self) -> None:
        """Write down what holds just after now."""
        self.recorder.record(self.now, self.inputs.sent(self.now.time))

    def _sense(self, q: Array, v: Array, s: Array) -> dict[str, float]:
        values = np.concatenate([q, v, s]).tolist()
        return dict(zip(self._sensed, values, strict=True))


def _samples(duration: float, sample: float | Array) -> Array:
    if np.ndim(sample):
        return np.asarray(sample, dtype=float)
    times = np.arange(int(duration / float(sample) + 1e-6) + 1) * float(sample)
    if duration - times[-1] > SAME_TIME:
        return np.append(times, duration)
    return np.append(times[:-1], duration)
