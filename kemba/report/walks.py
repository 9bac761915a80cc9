"""How shipped plans are made: one plan continued along one figure, step by step."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from kemba.files import write_json
from kemba.ocp import Plan, Task, load_task, plan
from kemba.ocp.certificate.objective import objective
from kemba.ocp.certificate.status import Status
from kemba.ocp.continuation.between import Origin
from kemba.ocp.planning import plan_from
from kemba.ocp.reading import task_model
from kemba.ocp.shipped.entry import read_plan, write_plan
from kemba.ocp.shipped.kind import FIGURES, figures_of, kind_of
from kemba.ocp.task.requirement import resolve
from kemba.report.judging.judged import judged, table_of

PATIENT = "solver.time_limit=3600 s"


def walk(work: Mapping[str, Any]) -> dict[str, Any]:
    """Plans of one task along one figure, each begun from the one before; a record of a sweep.

    `task`: its name; `set`: overrides that stay; `figure`: what changes, through `values`. The
    first plan begins from `first`, the stem of a plan in `folder`, or from a guess where that is
    empty. Every solved plan is kept in `folder`, with what its executions say. A value that cannot
    be reached is left out; the next one is tried from the last plan.
    """
    folder = Path(work["folder"])
    folder.mkdir(parents=True, exist_ok=True)
    origin = _kept(folder / f"{work['first']}.npz", work) if work["first"] else None
    told = []
    for value in work["values"]:
        own = [f"{work['figure']}={value}", PATIENT]  # the same plans on a slow machine
        task, document = load_task(work["task"], [*work["set"], *own])
        if origin is None:
            found: Plan | None = plan(task, document)
        else:
            found, _ = plan_from(origin, task, document)
        if found is None or found.status is not Status.SOLVED:
            told.append(f"{value}: none")
            continue
        origin = Origin(found.trajectory, found.model, found.requirements, once=True)
        facts = record(found) | {"task": work["task"], "set": list(work["set"]), "by": work["name"]}
        told.append(f"{value}: {facts['cost']:.3g}{'' if facts['good'] else ' (bad)'}")
        name = f"{work['name']}-{1e3 * float(str(value).split()[0]):04.0f}"
        write_plan(folder / f"{name}.npz", found.trajectory, found.model)
        write_json(folder / f"{name}.json", facts)
    return {"status": "walked", "good": True, "sentence": "; ".join(told)}


def record(found: Plan) -> dict[str, Any]:
    """Kind, figures and cost of a plan, and whether its executions keep to the tolerances."""
    task, model = found.task, found.model
    done = judged(found, table_of(found))
    return {
        "kind": kind_of(task, model),
        "figures": figures_of(task, model),
        "cost": objective(model, task, found.requirements, found.trajectory),
        **found.cost,
        "plant": done.facts["plant_replay"],
        "good": done.good,
    }


def _kept(file: Path, work: Mapping[str, Any]) -> Origin:
    """A plan of an earlier walk, as the first of this one."""
    facts = json.loads(file.with_suffix(".json").read_text(encoding="utf-8"))
    task, document = load_task(facts["task"], list(facts["set"]))
    own: Task = task.model_copy(update={k: facts["figures"].get(k) for k in FIGURES
                                        if getattr(task, k) is not None})  # fmt: skip
    model = task_model(own)
    asked = resolve(own, model, document)
    return Origin(read_plan(file), model, tuple(asked), once=True)
