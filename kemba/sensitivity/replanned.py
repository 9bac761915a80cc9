"""The plan made anew for a changed figure, to first order, with its phases kept.

The refined plan fulfils the optimality conditions of the multi-phase program. Differentiating them
gives one linear system (KKT matrix) for the derivatives of variables and multipliers by any
figure; it is factorised once. Source: Pirnay, Lopez-Negrete and Biegler 2012 (sIPOPT).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from kemba.config import Document
from kemba.effects import Effect
from kemba.effects.mechanics.load import Payload
from kemba.errors import KembaError, suggest
from kemba.model import Model
from kemba.ocp.nlp.ipopt import Control, Iterate
from kemba.ocp.phases.modes import Phase
from kemba.ocp.phases.notes import noted_phases
from kemba.ocp.phases.program import PhaseProgram
from kemba.ocp.phases.radau import RADAU5
from kemba.ocp.refinement.refine import Refiner, reduction_of, valve_columns
from kemba.ocp.refinement.solve import solve, warm
from kemba.ocp.task.resolve import resolve
from kemba.ocp.task.task import Task
from kemba.ocp.transcription.layout import STEP
from kemba.ocp.transcription.stage import COST_SCALE
from kemba.ocp.transcription.symmetry import Reduction
from kemba.ocp.transcription.unilateral import read_constraints
from kemba.sensitivity.kkt import Kkt, change_between
from kemba.trajectory import Trajectory

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


# proximal weight where the program alone does not converge: a thousandth of the refinement's
PULL = 1e-3
ITERATIONS = 100  # of the solve for the multipliers: twice those of a plan made from another
TOL = 1e-6  # IPOPT's tolerance of that solve: a hundredth of the refinement's
CHANGE = 0.02  # of a step, by which the rows are differenced: above rounding, below any bend


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


@dataclass
class Solution:
    """The solution of a plan's program, without any proximal term where that converges."""

    source: PlanProgram
    program: PhaseProgram
    point: Iterate

    @cached_property
    def kkt(self) -> Kkt:
        """The factorised system."""
        return Kkt.of(self.program, self.point)


def solution(source: PlanProgram, task: Task, model: Model) -> Solution:
    """A plan's program solved for a task and a model. Raises KembaError where it does not
    converge."""
    options = {**warm(ITERATIONS), "tol": TOL}
    for weight in (0.0, PULL):
        program, x = source.built(task, model)
        if weight:
            x = program.proximal(x, weight)
        point = solve(program, Iterate(x), options, Control())
        if point.solved:
            return Solution(source, program, point)
    assert point.ending is not None
    raise KembaError(task.name, f"the plan cannot be solved once more: {point.ending.sentence}")


def of_plan(found: Solution, changed: Sequence[FigureStep]) -> list[Replanned]:
    """For every figure of `changed`, what one step of it changes; see `Replanned`."""
    return [_of_figure(found, figure) for figure in changed]


def _of_figure(found: Solution, figure: FigureStep) -> Replanned:
    low, high = (found.source.built(*side)[0] for side in figure.sides(CHANGE))
    change = change_between(low, high, found.point)
    if change is None:
        return Replanned()
    dx = found.kkt.answer(change)
    times = _times(found.program)
    facts = {name: float(weights @ dx) / CHANGE for name, weights in times.items()}
    cost = (change.f + float(found.kkt.slope @ dx)) * COST_SCALE / CHANGE
    return Replanned(cost=cost, **facts)


def _times(program: PhaseProgram) -> dict[str, np.ndarray]:
    """Duration, touchdown [s] and apex [m] as weights (size,) of the variables."""
    c, phases = program.columns, program.phases

    def until(p: int) -> np.ndarray:
        weights = np.zeros(c.size)
        for before, phase in enumerate(phases[:p]):
            weights[c.h[before, 0]] += phase.elements * STEP
        return weights

    found = {"duration": until(len(phases))}
    landings = [p for p in program.impacts if phases[p].first > program.apex > 0]
    if landings:
        found["touchdown"] = until(landings[0])
    names = [q.name for q in program.layout.quantities["q"]]
    if program.apex and "body/z" in names:
        apex, j = np.zeros(c.size), names.index("body/z")
        apex[c.end(program.apex)["q"][j]] = program.layout.quantities["q"][j].scale
        found["apex"] = apex
    return found
