"""Both kinds of sensitivity as one table: `sensitivity.csv`."""

import csv
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kemba.errors import KembaError
from kemba.files import atomic_text
from kemba.model import Model
from kemba.ocp import load_task, task_model
from kemba.ocp.continuation.origin import read_stages
from kemba.ocp.phases.stages import Stages
from kemba.ocp.task.task import Task
from kemba.plant.certificate import rest_after
from kemba.plant.controller import Execution, execute_many
from kemba.runs import STAGES, load_run
from kemba.sensitivity.replanned import FigureStep, Replanned, figures, of_plan
from kemba.trajectory import Trajectory

NAN = float("nan")


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
