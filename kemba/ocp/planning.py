"""From a task to a certified plan: checked, solved, refined; or why there is none."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from kemba.config import Document, find_config
from kemba.effects.mechanics.load import Payload
from kemba.errors import KembaError
from kemba.model import Model, load_model
from kemba.model.changes import changed_effects
from kemba.ocp.certificate.status import Status
from kemba.ocp.continuation.between import Origin
from kemba.ocp.continued import continued, from_scratch
from kemba.ocp.infeasibility.checks import check_task
from kemba.ocp.infeasibility.explain import explanation, refusal
from kemba.ocp.nlp.ipopt import Control
from kemba.ocp.nlp.watcher import Watch
from kemba.ocp.planned import Plan, clear, explained
from kemba.ocp.planner import Planner, searched
from kemba.ocp.refined import refined
from kemba.ocp.relaxation.session import Session
from kemba.ocp.task.requirement import Requirement, resolve
from kemba.ocp.task.task import Task
from kemba.ocp.transcription.symmetry import whole
from kemba.ocp.transcription.transcribe import Transcription
from kemba.stopwatch import Stopwatch
from kemba.trajectory import Trajectory


def plan(
    task: Task,
    document: Document | None = None,
    model: str | Path | None = None,
    log: Path | None = None,
    tell: Callable[[str], None] = lambda text: None,
    watch: Watch | None = None,
    start: Trajectory | None = None,
    stop: Callable[[], bool] | None = None,
    origin: Origin | None = None,
) -> Plan:
    """Solve a task. Never raises for a task that cannot be met: the status says so.

    Raises ConfigErrors for wrong names, units and solver options. `log` collects IPOPT's text,
    `tell` gets the name of every solve, `watch` is called after every iteration; `start` is a
    trajectory to begin with; `stop` is asked after every iteration whether to end. `origin`: an
    earlier plan that is solved again for the changed figures; where that fails, the plan is made
    from scratch, and `Plan.continued` is False.
    """
    document = document or Document(task.model_dump())
    building = Stopwatch()
    with building.running():
        built = task_model(task, model, document)
        requirements = resolve(task, built, document)
        diagnostics = check_task(task, built, requirements, document)
        refused = refusal(diagnostics)
    deadline = time.monotonic() + task.solver.time_limit
    session = Session(Control(deadline, log, watch, stop), tell, building=building)
    planner = Planner(task, built, requirements, session, start)
    failed = ""
    if origin is not None and refused is None:
        near, failed = continued(planner, origin)
        if near is not None:
            return near
    found = searched(planner, refused is not None)
    if found.status is Status.SOLVED and task.refine == "radau":
        found = refined(planner, found)
    if found.status is Status.SOLVED and task.clearance:
        found = clear(found)
    if not found.status.plan and found.status is not Status.INTERRUPTED:
        why = refused or explanation(task, built, planner.outcome, diagnostics, document)
        found = found if why is None else explained(found, why)
    return from_scratch(found, failed) if failed else found


def task_model(
    task: Task, name: str | Path | None = None, document: Document | None = None
) -> Model:
    """The model of a task: its own unless `name` is given, with the task's supply, payload and
    changed effects. `document` gives the places of mistakes. Raises KembaError."""
    if name is None and document is not None:
        look_up(task, document)
    extra = changed_effects(name or task.model, task.effects, document)
    extra += [Payload(m=task.payload)] if task.payload else []
    return load_model(name or task.model, extra, task.supply)


def look_up(task: Task, document: Document) -> None:
    """Raise KembaError, at the line of the task, where it names a model that there is not."""
    for key, name in (("model", task.model), ("plant", task.plant)):
        try:
            find_config(name, "models")
        except KembaError as error:
            what = f"{key}: {name}: {error.what}"
            raise document.error((key,), what, error.expected, error.hint) from None


def check_feasible(
    task: Task, document: Document, model: str | Path | None = None
) -> tuple[Model, list[Requirement]]:
    """The model and the requirements of a task; nothing is solved.

    Raises KembaError for wrong names and units, and for what certainly cannot be met.
    """
    built = task_model(task, model, document)
    requirements = resolve(task, built, document)
    refused = refusal(check_task(task, built, requirements, document))
    if refused is not None:
        raise KembaError(document.source or task.name, refused.sentence)
    return built, requirements


def program_size(task: Task, document: Document, model: str | Path | None = None) -> dict[str, int]:
    """Variables and rows of the whole program of a task, everything checked, nothing solved.

    Raises KembaError as `check_feasible` does.
    """
    built, requirements = check_feasible(task, document, model)
    transcription = Transcription(built, task, requirements, whole(built.node), task.nodes)
    return {"variables": transcription.variables, "constraints": transcription.constraints}
