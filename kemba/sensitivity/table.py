"""What small changes of figures do: to the same commands, and to the plan made anew, its phases
kept, solved again half a step below and half a step above; as one table, `sensitivity.csv`."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kemba.config import Document
from kemba.effects import Effect
from kemba.effects.mechanics.load import Payload
from kemba.errors import KembaError, suggest
from kemba.events import PLANNED, read
from kemba.files import atomic_text
from kemba.model import Model
from kemba.ocp import load_task, task_model
from kemba.ocp.certificate.certify import objective
from kemba.ocp.continuation.continue_plan import Continuation
from kemba.ocp.continuation.origin import Origin, read_stages
from kemba.ocp.nlp.ipopt import Control
from kemba.ocp.phases.modes import Phase, noted_phases
from kemba.ocp.phases.program import PhaseProgram
from kemba.ocp.phases.radau import RADAU5
from kemba.ocp.phases.stages import Stages
from kemba.ocp.refinement.refine import Refiner, reduction_of, valve_columns
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.resolve import resolve
from kemba.ocp.task.task import Task
from kemba.ocp.transcription.symmetry import Reduction
from kemba.ocp.transcription.unilateral import read_constraints
from kemba.plant.certificate import rest_after
from kemba.plant.controller import Execution, execute_many
from kemba.runs import STAGES, load_run
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
    requirements, *_ = plan_phases(task, model, plan)
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


def plan_phases(
    task: Task, model: Model, plan: Trajectory
) -> tuple[list[Requirement], Reduction, list[Phase]]:
    """The phases of a refined plan of a task, with what is asked of it and the robot or half of it.
    Raises KembaError where the plan was not refined."""
    requirements = resolve(task, model, Document(task.model_dump()))
    reduction = reduction_of(model, task, requirements, plan)
    constraints = read_constraints(model, reduction)
    valves = len(valve_columns(model, reduction))
    phases = noted_phases(plan.meta, constraints, valves, len(plan) - 1)
    if phases is None:
        hint = "a plan that was refined has them, see `refine` of the task"
        raise KembaError(task.name, "the plan has no phases", hint=hint)
    return requirements, reduction, phases


def plan_program(task: Task, model: Model, plan: Trajectory) -> tuple[PhaseProgram, np.ndarray]:
    """The program of the phases of a refined plan by the finer scheme, and its start (size,) from
    the plan. Raises KembaError where the plan was not refined."""
    requirements, reduction, phases = plan_phases(task, model, plan)
    refiner = Refiner(model, task, requirements, plan, reduction, Control())
    return refiner.build(phases, plan, RADAU5)


@dataclass(frozen=True)
class Shift:
    """What one step of a figure changes: apex [m], touchdown [s], where the body ends [m].

    NaN where an execution fails or does not land. `lands`: whether both executions end standing.
    """

    apex: float = NAN
    touchdown: float = NAN
    end_x: float = NAN
    end_z: float = NAN
    lands: bool = False


def of_commands(
    model: Model, plan: Trajectory, table: Trajectory, changed: Sequence[FigureStep]
) -> list[Shift]:
    """For every figure of `changed`, the difference between half a step above and half below.

    The table goes through eq. 10 and the dead time, as on the robot. `plan`: the plan that the
    table was made from. Raises KembaError where the table does not fit the model.
    """
    rest = rest_after(model, plan, table)
    models = [side[1] for figure in changed for side in figure.sides()]
    done = execute_many(table, [{"model": m, "extra": rest} for m in models])
    pairs = zip(done[::2], done[1::2], models[::2], models[1::2], strict=True)
    return [_difference(plan, *pair) for pair in pairs]


def _difference(
    plan: Trajectory,
    low: Execution | KembaError,
    high: Execution | KembaError,
    below: Model,
    above: Model,
) -> Shift:
    if isinstance(low, KembaError) or isinstance(high, KembaError):
        return Shift()
    first, second = low.against(below, plan), high.against(above, plan)
    late = [np.nan if r.touchdown_error_s is None else r.touchdown_error_s for r in (first, second)]
    ends = [[run.trajectory[name][-1] for name in ("body/x", "body/z")] for run in (first, second)]
    x, z = (float(b - a) for a, b in zip(*ends, strict=True))
    apex, lands = second.apex_error_m - first.apex_error_m, first.landed and second.landed
    return Shift(apex, touchdown=float(late[1] - late[0]), end_x=x, end_z=z, lands=lands)


HEADER = (
    "figure", "unit", "value", "step",
    "commands/apex [m]", "commands/touchdown [s]", "commands/end_x [m]", "commands/end_z [m]",
    "commands/lands [1]",
    "replanned/cost [N2.m2.s]", "replanned/duration [s]", "replanned/touchdown [s]",
    "replanned/apex [m]",
)  # fmt: skip


@dataclass(frozen=True)
class Sensitivity:
    """What one step of every figure changes; None where there is no answer.

    `unsolved`: why the plan could not be made anew, empty where it was.
    """

    figures: tuple[FigureStep, ...]
    commands: tuple[Shift | None, ...]
    replanned: tuple[Replanned | None, ...]
    unsolved: str = ""


def sensitivity(
    task: Task,
    model: Model,
    plan: Trajectory,
    table: Trajectory,
    tell: Callable[[str], None] = lambda text: None,
    only: Sequence[str] = (),
    stages: Stages | None = None,
) -> Sensitivity:
    """Both kinds for the figures of a task and its `model`; `only`: the names of those wanted.

    `table`: the controller's table of the `plan`; `stages`: its solved program. Raises
    KembaError where it cannot be executed, and where there is no such figure.
    """
    listed = figures(task, model, only)
    machine = [figure for figure in listed if figure.machine]
    tell(f"the same commands, {len(machine)} figures")
    executed = iter(of_commands(model, plan, table, machine))
    commands = tuple(next(executed) if figure.machine else None for figure in listed)
    tell("the plan made anew")
    try:
        replanned: list[Replanned | None] = [*of_plan(task, model, plan, stages, listed)]
        why = ""
    except KembaError as error:
        replanned, why = [None] * len(listed), str(error)
    return Sensitivity(tuple(listed), commands, tuple(replanned), why)


def write_sensitivity(found: Sensitivity, path: Path) -> None:
    """One row a figure; numbers have six digits, what is unknown is empty. Raises KembaError."""
    with atomic_text(path) as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(HEADER)
        for row in zip(found.figures, found.commands, found.replanned, strict=True):
            writer.writerow(_cells(*row))


def _cells(figure: FigureStep, executed: Shift | None, new: Replanned | None) -> list[str]:
    e, r = executed or Shift(), new or Replanned()
    lands = float(e.lands) if executed else None
    numbers = [figure.value, figure.step, e.apex, e.touchdown, e.end_x, e.end_z, lands]
    numbers += [r.cost, r.duration, r.touchdown, r.apex]
    texts = ("" if n is None or n != n else f"{n:.6g}" for n in numbers)
    return [figure.name, figure.unit, *texts]


def sensitivity_of_run(
    run: str | Path, tell: Callable[[str], None] = lambda text: None, only: Sequence[str] = ()
) -> Sensitivity:
    """What small changes do to the plan of the folder `run`; `only`: the names of wanted figures;
    `tell` gets what is being done.

    Raises KembaError where the folder is no run, has no plan, or its model is gone, and where there
    is no such figure.
    """
    found = load_run(run)
    task, document = load_task(found.task)
    model, plan = task_model(task, document=document), found.trajectory
    stages = read_stages(found.path / STAGES)
    return sensitivity(task, model, plan, found.controller, tell, only, stages)
