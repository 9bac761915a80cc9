"""Executing cases, one or a block of them."""

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from kemba.config import Document, load_yaml, parse
from kemba.errors import ConfigErrors, KembaError
from kemba.files import sha256
from kemba.model import Model
from kemba.ocp.task.task import parse_task
from kemba.plant.commands import scattered
from kemba.plant.controller import execute, read_controller
from kemba.plant.repeat import PLAIN, counterpart
from kemba.plant.replay import Replay
from kemba.runs import load_run
from kemba.scenarios.draw import Conditions, changed_effects, sample, standing, start_offsets
from kemba.scene import Scene, scene_in
from kemba.sweep.cases import (
    Case,
    ExecuteBlock,
    Expansion,
    SolveBlock,
    Sweep,
    Work,
    content_hash,
    model_hash,
    model_name,
)
from kemba.trajectory import Trajectory


def execute_cases(expansion: Expansion, name: str, block: ExecuteBlock, folder: Path) -> list[Case]:
    """The cases of a block; its plan is made first where it is missing. Raises KembaError where a
    condition does not fit the model."""
    task = _task_data(expansion, name, block)
    plant, planned = model_name(expansion, block.plant), model_name(expansion, task["model"])
    made_for = {key: task[key] for key in ("supply", "payload") if task.get(key) is not None}
    given = block.conditions.model_dump(exclude_none=True, exclude_unset=True)
    base = Document({**made_for, **given})
    works = [
        (values, parse(expansion.varied(base, name, values), Conditions))
        for values in sample(block, name, expansion.sweep.seed)
    ]
    model = counterpart(planned, plant=plant)
    try:
        for _, conditions in works:
            changed_effects(model, conditions)
            start_offsets(model, conditions)
    except KembaError as error:
        what = ": ".join(part for part in (error.where, error.what) if part)
        raise expansion.document.error(("blocks", name), what, error.expected, error.hint) from None
    plan = _plan_folder(expansion, name, block, folder)
    shared = {
        "plan": str(plan.absolute()),
        "plan_hash": [sha256(plan / f) for f in ("trajectory.csv", "controller.csv")],
        "plant": plant,
        "plant_hash": model_hash(plant),
        "model": planned,
        "model_hash": model_hash(planned),
    }
    return [
        Case(name, index, values, "kemba.sweep.work:execute_case",
             shared | {"conditions": conditions.model_dump(exclude_none=True)}, name)
        for index, (values, conditions) in enumerate(works)
    ]  # fmt: skip


def _task_data(expansion: Expansion, name: str, block: ExecuteBlock) -> dict[str, Any]:
    """The task that the plan was made for. The robot and own effects of its `model` are the plant's
    too; its supply and payload are conditions unless the sweep says others."""
    if block.run is None:
        document = expansion.task_document(name)
        return {**document.data, "model": parse_task(document).model}
    file = _run_folder(expansion, block.run) / "task.yaml"
    return {"model": PLAIN, **(load_yaml(file).data if file.is_file() else {})}


def _run_folder(expansion: Expansion, run: str) -> Path:
    near = expansion.beside / run
    return near if near.is_dir() else Path(run)


def _plan_folder(expansion: Expansion, name: str, block: ExecuteBlock, folder: Path) -> Path:
    """The folder of the plan to execute. Raises KembaError when there is no good plan."""
    from kemba.solve import Approach, Listener, best_plan

    if block.run is not None:
        run = load_run(_run_folder(expansion, block.run))
        assert len(run.controller) and len(run.trajectory)
        return run.path
    document = expansion.task_document(name)
    task = parse_task(document)
    path = folder / "plans" / content_hash(task.model_dump(exclude_none=True))
    if not (path / "controller.csv").is_file():
        best = best_plan(task, document, Approach(), Listener())
        if not best.plan.status.plan or best.motions.table is None:
            at = ("blocks", name, "task")
            raise expansion.document.error(at, f"{block.task}: {best.result['sentence']}")
        best.plan.trajectory.write(path / "trajectory.csv")
        best.motions.table.write(path / "controller.csv")
    return path


def run_on_plant(work: Work) -> Replay:
    """The execution that a case asks for, compared with its plan."""
    conditions = parse(work["conditions"], Conditions)
    table = read_controller(work["plan"])
    where = scene_in(table.meta)
    plain = _plant(work["model"], conditions.supply, work["plant"], work["plant_hash"], where)
    model = plain.with_effects(changed_effects(plain, conditions))
    rng = np.random.default_rng(conditions.seed)
    done = execute(
        table,
        model,
        gains=conditions.gains,
        extra=conditions.after,
        start=standing(model, table, start_offsets(model, conditions)),
        valves=scattered(model, table, conditions.jitter, rng) if conditions.jitter else None,
    )
    return done.against(model, Trajectory.read(Path(work["plan"]) / "trajectory.csv"))


@lru_cache(maxsize=8)
def _plant(model: str, supply: float | None, plant: str, content: str, scene: Scene) -> Model:
    """The plant as it is, kept by a worker: cases that change its numbers share its machine code.

    `content`: the hash of its files, so that a changed file is read again.
    """
    return counterpart(model, supply=supply, plant=plant, scene=scene)


# Keys of a task that say how it is solved, not what is asked.
HOW = {"name", "notes", "guess", "guess_noise", "seed", "method", "solver", "tolerances"}


def expand(sweep: Sweep, document: Document, folder: Path) -> list[Case]:
    """All cases of a `sweep`, which `document` tells the places of. Raises KembaError: ConfigErrors
    with the mistakes of all blocks.

    `folder` keeps the plans that are to be executed; they are made here when missing.
    """
    expansion = Expansion(sweep, document)
    cases: list[Case] = []
    errors: list[KembaError] = []
    for name, block in sweep.blocks.items():
        try:
            if isinstance(block, ExecuteBlock):
                cases += execute_cases(expansion, name, block, folder)
            else:
                cases += _solve_cases(expansion, name, block)
        except ConfigErrors as error:
            errors += error.errors
        except KembaError as error:
            errors.append(error)
    if errors:
        raise ConfigErrors({str(error): error for error in errors}.values())
    return cases


def _solve_cases(expansion: Expansion, name: str, block: SolveBlock) -> list[Case]:
    from kemba.ocp import task_model
    from kemba.ocp.task.resolve import resolve

    base = expansion.task_document(name)
    cases = []
    for index, values in enumerate(sample(block, name, expansion.sweep.seed)):
        document = expansion.varied(base, name, values)
        task = parse_task(document)
        task = task.model_copy(update={"model": model_name(expansion, block.model or task.model)})
        if index == 0:  # names of quantities are the same in all
            resolve(task, task_model(task, document=document), document)
        work: dict[str, Any] = {
            "task": task.model_dump(exclude_none=True),
            "model": model_hash(task.model),
            "replay": block.replay,
        }
        aim = {key: value for key, value in work["task"].items() if key not in HOW}
        problem = content_hash([aim, work["model"]])
        cases.append(Case(name, index, values, "kemba.sweep.work:solve_case", work, problem))
    return cases
