"""From a task to a certified plan: checked, solved, refined; or why there is none."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice
from pathlib import Path

from kemba.config import Document
from kemba.errors import KembaError
from kemba.model import Model
from kemba.ocp.certificate.status import Status
from kemba.ocp.continuation.between import Origin
from kemba.ocp.continued import continued, from_scratch, with_grip
from kemba.ocp.finer import found_and_refined
from kemba.ocp.infeasibility.checks import check_task
from kemba.ocp.infeasibility.diagnostic import Diagnostic
from kemba.ocp.infeasibility.explain import Explanation, explanation, refusal
from kemba.ocp.nlp.ipopt import Control
from kemba.ocp.nlp.watcher import Watch
from kemba.ocp.planned import Plan, clear, explained
from kemba.ocp.planner import Planner
from kemba.ocp.reading import asked_of, task_model
from kemba.ocp.relaxation.session import Session
from kemba.ocp.sequence import as_one, motions
from kemba.ocp.shipped.entry import Entry
from kemba.ocp.shipped.shelf import Near, Neighbour, neighbours, relatives, ways
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.resolve import resolve
from kemba.ocp.task.task import Task
from kemba.ocp.transcription.symmetry import whole
from kemba.ocp.transcription.transcribe import Transcription
from kemba.stopwatch import Stopwatch, Tell, silent
from kemba.trajectory import Trajectory


def plan(
    task: Task,
    document: Document | None = None,
    model: str | Path | None = None,
    log: Path | None = None,
    tell: Tell = silent,
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
    job = _job(task, document, model, Control(_deadline(task), log, watch, stop), tell, start)
    planner, refused, failed = job.planner, job.refused, ""
    if origin is not None and refused is None:
        near, failed = continued(planner, origin)
        if near is not None:
            return near
    found = found_and_refined(planner, refused is not None)
    if found.status is Status.SOLVED and task.grip < 1.0:
        found = with_grip(planner, found)
    if found.status is Status.SOLVED and task.clearance:
        found = clear(found)
    if not found.status.plan and found.status is not Status.INTERRUPTED:
        own = task, planner.model, planner.outcome, job.diagnostics, job.document
        why = refused or explanation(*own)
        found = found if why is None else explained(found, why)
    return from_scratch(found, failed) if failed else found


def plans_nearby(
    task: Task,
    document: Document | None = None,
    log: Path | None = None,
    tell: Tell = silent,
    watch: Watch | None = None,
    stop: Callable[[], bool] | None = None,
) -> Iterator[tuple[Plan, Entry]]:
    """Plans of a task and the near shipped plans from which they begin, the nearest of each way
    (`ways`).

    Only solved ones; none where no shipped plan is near, or the task cannot be met. Raises
    ConfigErrors as `plan` does.
    """
    control = Control(_deadline(task), log, watch, stop)
    job = _job(task, document, None, control, tell)
    if job.refused is not None:
        return
    model, tried = job.planner.model, Near.current().tried
    listed = neighbours(task, model)
    if not listed:
        listed = relatives(task, model)
        if next(job.planner.reductions()).symmetric:
            tried = 1  # a plan of half the robot from a guess takes little longer
    for near in islice(ways(listed), tried):
        found, _ = continued(job.planner, _origin(near))
        if found is not None and found.status is Status.SOLVED:
            yield replace(found, continued=None, start=f"shipped: {near.entry.name}"), near.entry
        if control.ended() is not None:
            return


def _origin(near: Neighbour) -> Origin:
    """A shipped plan with its model and what was asked of it."""
    entry, own = near.entry, near.asked()
    model = task_model(own)
    asked = resolve(own, model, Document(own.model_dump()))
    name, dear = f"the shipped plan {entry.name}", "one from a guess (--cold) may take less"
    once, stages = own.grip == 1.0, entry.stages
    return Origin(entry.plan, model, tuple(asked), name, dear, once=once, stages=stages)


def plan_from(
    origin: Origin,
    task: Task,
    document: Document | None = None,
    log: Path | None = None,
    tell: Tell = silent,
    watch: Watch | None = None,
    stop: Callable[[], bool] | None = None,
) -> tuple[Plan | None, str]:
    """A task's plan from another plan, or None and the reason where that fails."""
    control = Control(_deadline(task), log, watch, stop)
    return continued(_job(task, document, None, control, tell).planner, origin)


@dataclass(frozen=True)
class _Job:
    """A task, and what solves it."""

    document: Document
    planner: Planner

    @cached_property
    def diagnostics(self) -> Sequence[Diagnostic]:
        """What certainly cannot be met; found when it is asked for."""
        p = self.planner
        with p.session.building.running():
            return check_task(p.task, p.model, p.requirements, self.document)

    @property
    def refused(self) -> Explanation | None:
        """Why there is no plan to be sought."""
        return refusal(self.diagnostics)


def _job(
    task: Task,
    document: Document | None,
    model: str | Path | None,
    control: Control,
    tell: Tell = silent,
    start: Trajectory | None = None,
) -> _Job:
    document = document or Document(task.model_dump())
    building = Stopwatch()
    with building.running():
        if task.sequence:
            task, built, requirements = as_one(task, document)
        else:
            built, requirements = asked_of(task, document, model)
    session = Session(control, tell, building=building)
    return _Job(document, Planner(task, built, requirements, session, start))


def _deadline(task: Task) -> float:
    return time.monotonic() + task.solver.time_limit


def check_feasible(
    task: Task, document: Document, model: str | Path | None = None
) -> tuple[Model, list[Requirement]]:
    """The model and the requirements of a task; nothing is solved.

    Of a sequence every motion is checked, and those of the last are given. Raises KembaError for
    wrong names and units, and for what certainly cannot be met.
    """
    for part, own in motions(task, document):
        check_feasible(part, own)
    if task.sequence:
        _, built, requirements = as_one(task, document)
        return built, requirements
    built, requirements = asked_of(task, document, model)
    refused = refusal(check_task(task, built, requirements, document))
    if refused is not None:
        raise KembaError(document.source or task.name, refused.sentence)
    return built, requirements


def program_size(task: Task, document: Document, model: str | Path | None = None) -> dict[str, int]:
    """Variables and rows of the whole program of a task, everything checked, nothing solved.

    Raises KembaError as `check_feasible` does.
    """
    built, requirements = check_feasible(task, document, model)
    if task.sequence:
        task, built, requirements = as_one(task, document)
    transcription = Transcription(built, task, requirements, whole(built.node), task.nodes)
    return {"variables": transcription.variables, "constraints": transcription.constraints}
