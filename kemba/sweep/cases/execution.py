"""Executing one plan under many conditions."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from kemba.config import Document, load_yaml, parse
from kemba.effects import Effect
from kemba.effects.catalogue import BY_KIND
from kemba.effects.mechanics.load import Payload
from kemba.errors import KembaError, suggest
from kemba.model import Model
from kemba.plant import Gains, Replay, execute
from kemba.plant.execution.controller import read_controller
from kemba.plant.execution.counterpart import PLAIN, counterpart
from kemba.plant.execution.replay import LandingSettings, first_row
from kemba.plant.simulation.valves import scattered
from kemba.quantity import to_si
from kemba.runs import load_run, sha256
from kemba.sweep.cases.case import Case, Work, content_hash
from kemba.sweep.cases.expand import Expansion, model_hash, model_name
from kemba.sweep.cases.sampling import sample
from kemba.sweep.cases.schema import Conditions, ExecuteBlock
from kemba.trajectory import Trajectory


def execute_cases(expansion: Expansion, name: str, block: ExecuteBlock, folder: Path) -> list[Case]:
    """The cases of a block; its plan is made first where it is missing.

    Raises KembaError where a condition does not fit the model.
    """
    plant, planned = (
        model_name(expansion, m) for m in (block.plant, _model(expansion, name, block))
    )
    base = Document({**_planned(expansion, name, block), **_given(block.conditions)})
    works = []
    for values in sample(block, name, expansion.sweep.seed):
        conditions = parse(expansion.varied(base, name, values), Conditions)
        works.append((values, conditions))
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
        Case(name, index, values, "kemba.sweep.workers.work:execute_case",
             shared | {"conditions": conditions.model_dump(exclude_none=True)}, name)
        for index, (values, conditions) in enumerate(works)
    ]  # fmt: skip


def _given(conditions: Conditions) -> dict[str, Any]:
    return conditions.model_dump(exclude_none=True, exclude_unset=True)


def _planned(expansion: Expansion, name: str, block: ExecuteBlock) -> dict[str, Any]:
    """Supply and payload that the plan was made for: conditions unless the sweep says others."""
    if block.run is None:
        task = expansion.task_document(name).data
    else:
        file = _run_folder(expansion, block.run) / "task.yaml"
        task = load_yaml(file).data if file.is_file() else {}
    return {key: task[key] for key in ("supply", "payload") if task.get(key) is not None}


def _model(expansion: Expansion, name: str, block: ExecuteBlock) -> str:
    """The model that the plan was made with: its robot and own effects are the plant's too."""
    from kemba.ocp.task.task import parse_task

    if block.run is None:
        return parse_task(expansion.task_document(name)).model
    file = _run_folder(expansion, block.run) / "task.yaml"
    task = load_yaml(file).data if file.is_file() else {}
    return str(task.get("model", PLAIN))


def _run_folder(expansion: Expansion, run: str) -> Path:
    near = expansion.beside / run
    return near if near.is_dir() else Path(run)


def _plan_folder(expansion: Expansion, name: str, block: ExecuteBlock, folder: Path) -> Path:
    """The folder of the plan to execute. Raises KembaError when there is no good plan."""
    from kemba.ocp import controller_table, plan
    from kemba.ocp.task.task import parse_task

    if block.run is not None:
        run = load_run(_run_folder(expansion, block.run))
        assert len(run.controller) and len(run.trajectory)
        return run.path
    document = expansion.task_document(name)
    task = parse_task(document)
    path = folder / "plans" / content_hash(task.model_dump(exclude_none=True))
    if not (path / "controller.csv").is_file():
        found = plan(task, document)
        if not found.status.plan:
            at = ("blocks", name, "task")
            raise expansion.document.error(at, f"{block.task}: {found.sentence}")
        found.trajectory.write(path / "trajectory.csv")
        controller_table(found.model, found.trajectory, task.hold).write(path / "controller.csv")
    return path


def run_on_plant(work: Work) -> Replay:
    """The execution that a case asks for, compared with its plan."""
    conditions = parse(work["conditions"], Conditions)
    plain = _plant(work["model"], conditions.supply, work["plant"], work["plant_hash"])
    model = plain.with_effects(changed_effects(plain, conditions))
    table = read_controller(work["plan"])
    rng = np.random.default_rng(conditions.seed)
    done = execute(
        table,
        model,
        Gains(conditions.gains.K_p, conditions.gains.K_d),
        extra=conditions.after,
        start=standing(model, table, start_offsets(model, conditions)),
        valves=scattered(model, table, conditions.jitter, rng) if conditions.jitter else None,
    )
    return done.against(model, Trajectory.read(Path(work["plan"]) / "trajectory.csv"))


@lru_cache(maxsize=8)
def _plant(model: str, supply: float | None, plant: str, content: str) -> Model:
    """The plant as it is, kept by a worker: cases that change its numbers share its machine code.

    `content`: the hash of its files, so that a changed file is read again.
    """
    return counterpart(model, supply=supply, plant=plant)


def changed_effects(model: Model, conditions: Conditions) -> list[Effect]:
    """The effects that differ from the plant's. Raises KembaError for unknown kinds."""
    changed: list[Effect] = [Payload(m=conditions.payload)] if conditions.payload else []
    for kind, parameters in conditions.effects.items():
        if kind not in BY_KIND:
            raise KembaError(f"effects.{kind}", "no such effect", hint=suggest(kind, BY_KIND))
        listed = next((e for e in model.effects if e.name == kind), None)
        own = listed.model_dump() if listed else {}
        try:
            changed.append(parse({**own, "kind": kind, **parameters}, BY_KIND[kind]))
        except KembaError as error:
            raise KembaError(f"effects.{kind}", error.what, error.expected, error.hint) from None
    return changed


def start_offsets(model: Model, conditions: Conditions) -> dict[str, float]:
    """Offsets of the first pose in SI units. Raises KembaError for what is no coordinate."""
    mechanism = model.mechanism
    knees = {f"{leg}/knee/q" for leg in mechanism.legs}  # their pistons are easier to picture
    units = {c.name: c.unit for c in mechanism.coordinates if c.name not in knees}
    units |= {f"{leg}/piston/x": "m" for leg in mechanism.legs}
    offsets = {}
    for name, value in conditions.start.items():
        if name not in units:
            raise KembaError(f"start.{name}", "no such coordinate", hint=suggest(name, units))
        try:
            offsets[name] = to_si(value, units[name])
        except ValueError as error:
            raise KembaError(f"start.{name}", str(error)) from None
    return offsets


def standing(model: Model, table: Trajectory, offsets: Mapping[str, float]) -> dict[str, float]:
    """The table's first pose, moved; a lower foot that stands is put on the ground again."""
    from kemba.plant.simulation.start import initial_values, lowest_foot

    if not offsets:
        return {}
    pose = first_row(model, table)
    moved = {name: pose.get(name, 0.0) + offset for name, offset in offsets.items()}
    if lowest_foot(model, pose) > LandingSettings.current().on_ground:
        return moved  # it is dropped: held in the air as the table says
    q, *_ = initial_values(model, pose | moved)
    height = q[[c.name for c in model.mechanism.coordinates].index("body/z")]
    lowest = lowest_foot(model, pose | moved)
    return moved | {"body/z": float(height - lowest)}
