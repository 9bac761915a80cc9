"""Both kinds of sensitivity as one table: `sensitivity.csv`."""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from kemba.errors import KembaError
from kemba.files import atomic_text
from kemba.model import Model
from kemba.ocp.nlp.ipopt import Control
from kemba.ocp.task.task import Task
from kemba.sensitivity.commands import Shift, of_commands
from kemba.sensitivity.figures import FigureStep, figures
from kemba.sensitivity.replanned import PlanProgram, Replanned, of_plan, solution
from kemba.trajectory import Trajectory

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

    `unsolved`: why the plan could not be differentiated, empty where it was.
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
    control: Control | None = None,
    only: Sequence[str] = (),
) -> Sensitivity:
    """Both kinds for the figures of a task and its `model`; `only`: the names of those wanted.

    `table`: the controller's table of the `plan`. Raises KembaError where it cannot be executed,
    and where there is no such figure.
    """
    listed = figures(task, model, only)
    machine = [figure for figure in listed if figure.machine]
    tell(f"the same commands, {len(machine)} figures")
    executed = iter(of_commands(model, plan, table, machine))
    commands = tuple(next(executed) if figure.machine else None for figure in listed)
    tell("the plan made anew")
    try:
        source = PlanProgram.of(task, model, plan)
        replanned: list[Replanned | None] = [
            *of_plan(solution(source, task, model, control), listed)
        ]
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
    return [figure.name, figure.unit, *map(_text, numbers)]


def _text(number: float | None) -> str:
    return "" if number is None or number != number else f"{number:.6g}"
