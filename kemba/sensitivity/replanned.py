"""The plan made anew for a changed figure of the task or the machine, its phases kept: solved again
half a step below and half a step above."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from kemba.config import Document
from kemba.effects import Effect
from kemba.effects.mechanics.load import Payload
from kemba.errors import KembaError, suggest
from kemba.events import PLANNED, read
from kemba.model import Model
from kemba.ocp.certificate.certify import objective
from kemba.ocp.continuation.continue_plan import Continuation
from kemba.ocp.continuation.origin import Origin
from kemba.ocp.nlp.ipopt import Control
from kemba.ocp.phases.modes import Phase, noted_phases
from kemba.ocp.phases.program import PhaseProgram
from kemba.ocp.phases.radau import RADAU5
from kemba.ocp.phases.stages import Stages
from kemba.ocp.refinement.refine import Refiner, reduction_of, valve_columns
from kemba.ocp.task.resolve import resolve
from kemba.ocp.task.task import Task
from kemba.ocp.transcription.symmetry import Reduction
from kemba.ocp.transcription.unilateral import read_constraints
from kemba.trajectory import Array, Trajectory

Problem = tuple[Task, Model]


# by how much figures change: height and distance [m], supply [Pa], payload [kg], the numbers of
# effects as a share
LENGTH, PRESSURE, MASS, SHARE = 0.01, 10e3, 0.1, 0.1


@dataclass(frozen=True)
class FigureStep:
    """One figure: its value and the `step` by which it changes, in its unit.

    A whole table of an effect has the value 1: it is multiplied by a factor. `machine`: whether it
    is a figure of the machine, so that the same commands give another motion. `at`: task and model
    with another value.
    """

    name: str
    unit: str
    value: float
    step: float
    machine: bool
    at: Callable[[float], Problem]

    def sides(self, share: float = 1.0) -> tuple[Problem, Problem]:
        """Task and model half a step below and half a step above, or a `share` of that."""
        half = 0.5 * share * self.step
        return self.at(self.value - half), self.at(self.value + half)


def figures(task: Task, model: Model, only: Sequence[str] = ()) -> list[FigureStep]:
    """Height or feet, distance, supply, payload, and every number of the model's effects.

    `only`: the names of those that are wanted. Raises KembaError where there is no such figure.
    """
    found = [*_asked(task, model), *_air_and_load(task, model), *_effects(task, model)]
    names = [figure.name for figure in found]
    for name in only:
        if name not in names:
            raise KembaError(task.name, f"no figure '{name}'", hint=suggest(name, names))
    return [figure for figure in found if not only or figure.name in only]


def _asked(task: Task, model: Model) -> Iterator[FigureStep]:
    for name in ("height", "feet", "distance"):
        value = getattr(task, name)
        if value is not None:

            def changed(value: float, name: str = name) -> Problem:
                return task.model_copy(update={name: value}), model

            yield FigureStep(name, "m", float(value), LENGTH, False, changed)


def _air_and_load(task: Task, model: Model) -> Iterator[FigureStep]:

    def fed(pressure: float) -> Problem:
        return task, Model(model.mechanism, model.effects, pressure, model.name)

    def loaded(mass: float) -> Problem:
        return task, model.with_effects([Payload.model_construct(kind="payload", m=mass)])

    yield FigureStep("supply", "Pa", model.supply, PRESSURE, True, fed)
    yield FigureStep("payload", "kg", task.payload, MASS, True, loaded)


def _effects(task: Task, model: Model) -> Iterator[FigureStep]:
    """Numbers by themselves; a table as a factor on all of it."""
    for effect in model.effects:
        if not effect.moves or effect.kind == "payload":
            continue
        numbers = effect.parameters()
        for name in dict.fromkeys([*numbers, *(n.split("[")[0] for n in effect.tolerances())]):
            value, label = effect.value(name), f"{effect.name}.{name}"
            change = _effect_with(task, model, effect, name)
            if isinstance(value, tuple):
                yield FigureStep(label, "1", 1.0, SHARE, True, change)
            elif value:
                step = SHARE * abs(float(value))
                yield FigureStep(label, numbers[name].unit, float(value), step, True, change)


def _effect_with(task: Task, model: Model, effect: Effect, name: str) -> Callable[[float], Problem]:
    old = effect.value(name)

    def change(value: float) -> Problem:
        new = tuple(value * x for x in old) if isinstance(old, tuple) else value
        return task, model.with_effects([effect.bind({name: new})])

    return change


NAN = float("nan")


@dataclass(frozen=True)
class Replanned:
    """What one step of a figure changes in the best plan of the same phases.

    `cost` in the task's own weights [N2.m2.s], `duration` and `touchdown` [s], `apex` [m]; NaN
    where there is none.
    """

    cost: float = NAN
    duration: float = NAN
    touchdown: float = NAN
    apex: float = NAN


def of_plan(
    task: Task, model: Model, plan: Trajectory, stages: Stages | None, changed: Sequence[FigureStep]
) -> list[Replanned]:
    """For every figure of `changed`, what one step of it changes; see `Replanned`. `stages`: the
    solved program of the plan, if it is at hand. Raises KembaError where it was not refined."""
    PlanProgram.of(task, model, plan)
    requirements = resolve(task, model, Document(task.model_dump()))
    origin = Origin(plan, model, tuple(requirements), once=True, stages=stages)
    ends = [[_again(origin, *side) for side in figure.sides()] for figure in changed]
    return [Replanned(*map(float, high - low)) for low, high in ends]


def _again(origin: Origin, task: Task, model: Model) -> Array:
    """Cost, duration, touchdown and apex (4,) of the plan for another task and model."""
    requirements = resolve(task, model, Document(task.model_dump()))
    new = Continuation(model, task, requirements, origin, Control()).run().trajectory
    if new is None:
        return np.full(4, NAN)
    landing = read(new, PLANNED, model.mechanism.weight).landing
    cost = objective(model, task, requirements, new)
    return np.array([cost, new.time[-1], landing if landing < np.inf else NAN, new["body/z"].max()])


@dataclass
class PlanProgram:
    """The program of the phases of a refined plan; `built` makes it for any task and model."""

    plan: Trajectory
    reduction: Reduction
    phases: list[Phase]

    @classmethod
    def of(cls, task: Task, model: Model, plan: Trajectory) -> PlanProgram:
        """The program of a plan of a task. Raises KembaError where the plan was not refined."""
        requirements = resolve(task, model, Document(task.model_dump()))
        reduction = reduction_of(model, task, requirements, plan)
        constraints = read_constraints(model, reduction)
        valves = len(valve_columns(model, reduction))
        phases = noted_phases(plan.meta, constraints, valves, len(plan) - 1)
        if phases is None:
            hint = "a plan that was refined has them, see `refine` of the task"
            raise KembaError(task.name, "the plan has no phases", hint=hint)
        return cls(plan, reduction, phases)

    def built(self, task: Task, model: Model) -> tuple[PhaseProgram, np.ndarray]:
        """The program by the finer scheme, and its start (size,) from the plan."""
        requirements = resolve(task, model, Document(task.model_dump()))
        refiner = Refiner(model, task, requirements, self.plan, self.reduction, Control())
        return refiner.build(self.phases, self.plan, RADAU5)
