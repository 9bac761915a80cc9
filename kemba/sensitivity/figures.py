"""The figures of a task and its model that are changed a little, one after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from kemba.effects import Effect
from kemba.effects.mechanics.load import Payload
from kemba.errors import KembaError, suggest
from kemba.model import Model
from kemba.ocp.task.task import Task

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
            yield FigureStep(
                name,
                "m",
                float(value),
                LENGTH,
                False,
                _task_with(task, model, name),
            )


def _task_with(task: Task, model: Model, name: str) -> Callable[[float], Problem]:
    return lambda value: (task.model_copy(update={name: value}), model)


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
