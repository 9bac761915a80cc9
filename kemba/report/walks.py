"""How shipped plans are made: one plan continued along one figure, step by step."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from kemba.config import Document
from kemba.files import write_json
from kemba.ocp import Plan, Task, load_task, plan
from kemba.ocp.certificate.objective import objective
from kemba.ocp.certificate.status import Status
from kemba.ocp.continuation.between import Origin
from kemba.ocp.continuation.kept import read_stages
from kemba.ocp.planning import plan_from
from kemba.ocp.reading import task_model
from kemba.ocp.shipped.entry import read_plan, write_plan
from kemba.ocp.shipped.kind import FIGURES, figures_of
from kemba.ocp.task.requirement import resolve
from kemba.report.best import Approach, best_plan, improved
from kemba.report.judging.executed import Executed, executed
from kemba.report.judging.judged import plant_of
from kemba.report.listener import Listener
from kemba.scenarios.draw import scenarios
from kemba.scenarios.share import share
from kemba.stopwatch import silent

PATIENT = "solver.time_limit=3600 s"
SCENARIOS = 60  # in which a plan is executed before it is shipped


def walk(work: Mapping[str, Any]) -> dict[str, Any]:
    """Plans of one task along one figure, each begun from the one before; a record of a sweep.

    `task`: its name; `set`: overrides that stay; `figure`: what changes, through `values`. The
    first plan begins from `first`, the stem of a plan in `folder`, or from a guess where that is
    empty. Every solved plan is kept in `folder`, with its solved program and what its executions
    say. A value that cannot be reached is left out; the next one is tried from the last plan.
    `matched`: plans are changed until their executions keep to the tolerances, as by `solve`, with
    air fitted to the plant.
    """
    folder = Path(work["folder"])
    folder.mkdir(parents=True, exist_ok=True)
    last = _kept(folder / f"{work['first']}.npz", work) if work["first"] else None
    told = []
    for value in work["values"]:
        own = [f"{work['figure']}={value}", PATIENT]  # the same plans on a slow machine
        task, document = load_task(work["task"], [*work["set"], *own])
        made = _made(task, document, last, work.get("matched", False))
        if made is None:
            told.append(f"{value}: none")
            continue
        found = made.plan
        origin = Origin(
            found.trajectory, found.model, found.requirements, once=True, stages=found.stages
        )
        last = Last(origin, found.task.effects, made.result.get("fitted_air"))
        facts = record(made) | {"task": work["task"], "set": list(work["set"]), "by": work["name"]}
        told.append(f"{value}: {facts['cost']:.3g}{'' if facts['good'] else ' (bad)'}")
        name = f"{work['name']}-{1e3 * float(str(value).split()[0]):04.0f}"
        kept = folder / f"{name}.npz"
        write_plan(kept, found.trajectory, found.model, last.air, found.stages)
        write_json(folder / f"{name}.json", facts)
    return {"status": "walked", "good": True, "sentence": "; ".join(told)}


@dataclass(frozen=True)
class Last:
    """The plan before, with the `effects` of its fitted air and the fit, None where there was
    none."""

    origin: Origin
    effects: Mapping[str, Mapping[str, Any]]
    fitted_air: Mapping[str, Any] | None

    @property
    def air(self) -> dict[str, Any]:
        """What is kept of the fit beside the plan."""
        fit = {"effects": self.effects, "fitted_air": self.fitted_air}
        return fit if self.fitted_air else {}


def record(made: Executed) -> dict[str, Any]:
    """Figures and cost of a plan, whether its executions keep to the tolerances, and in how many of
    `SCENARIOS` it lands: `usual`, and `landed` at twice the usual uncertainty."""
    found = made.plan
    task, model = found.task, found.model
    return {
        "figures": figures_of(task, model),
        "cost": objective(model, task, found.requirements, found.trajectory),
        **found.cost,
        "plant": made.result["plant_replay"],
        "table": made.result["table_replay"],
        "good": made.good,
        "usual": _landed(made, "usual"),
        "landed": _landed(made, "twice"),
    }


def _landed(made: Executed, uncertainties: str) -> int:
    """In how many scenarios a plan lands; 0 where it has no table."""
    found, table = made.plan, made.motions.table
    cases = scenarios(uncertainties, plant_of(found.task), SCENARIOS)
    return share(found.model, found.trajectory, table, cases).landed if table is not None else 0


def _made(task: Task, document: Document, last: Last | None, match: bool) -> Executed | None:
    """The plan of one value, executed; with `match` changed until it comes true, or made from a
    guess where it does not."""
    if last is None:
        found: Plan | None = plan(task, document)
    else:
        asked = task.model_copy(update={"effects": {**task.effects, **last.air.get("effects", {})}})
        found, _ = plan_from(last.origin, asked, document)
        found = found and replace(found, fitted_air=last.fitted_air)
    made = None
    if found is not None and found.status is Status.SOLVED:
        made = executed(found, None, None, True, silent, lambda plan: None)
        if match:
            made = improved(made, task, document, Listener())[0]
    if match and (made is None or not made.good):
        made = best_plan(task, document, Approach(cold=True), Listener())
    return made if made is not None and made.plan.status is Status.SOLVED else None


def _kept(file: Path, work: Mapping[str, Any]) -> Last:
    """A plan of an earlier walk, as the first of this one."""
    facts = json.loads(file.with_suffix(".json").read_text(encoding="utf-8"))
    task, document = load_task(facts["task"], list(facts["set"]))
    kept = read_plan(file)
    air = {"effects": kept.meta.get("effects", {})}
    own: Task = task.model_copy(update={k: facts["figures"].get(k) for k in FIGURES
                                        if getattr(task, k) is not None} | air)  # fmt: skip
    model = task_model(own)
    asked = resolve(own, model, document)
    origin = Origin(kept, model, tuple(asked), once=True, stages=read_stages(file))
    return Last(origin, own.effects, kept.meta.get("fitted_air"))
