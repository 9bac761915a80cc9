"""From a task to a certified plan: strategies in turn, the first that solves wins."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from kemba.config import Document
from kemba.effects.load import Payload
from kemba.model import Model, load_model
from kemba.ocp.certify import Certificate, certify, costs
from kemba.ocp.checks import check_task
from kemba.ocp.elastic import Outcome, elastic
from kemba.ocp.explain import Explanation, explanation, refusal
from kemba.ocp.finding import Relax
from kemba.ocp.guess import automatic_guess
from kemba.ocp.ipopt import Ipopt, Point, Watch
from kemba.ocp.mirror import Reduction, find_symmetry, whole, wishes_are_symmetric
from kemba.ocp.penalty import WEIGHTS, penalise
from kemba.ocp.phases import refine as solve_phases
from kemba.ocp.result import to_trajectory
from kemba.ocp.resume import resumed
from kemba.ocp.schedule import (
    RELAX,
    Attempt,
    Search,
    Stopped,
    binary,
    confirm,
    find,
    fix,
    refine,
    tighten,
)
from kemba.ocp.switching import polish
from kemba.ocp.task import Task
from kemba.ocp.transcribe import Transcription
from kemba.ocp.verdict import verdict
from kemba.ocp.wishes import Wish, resolve
from kemba.trajectory import Trajectory

COARSEST = 24  # nodes below which a coarser grid no longer helps
NUDGE = 0.05  # guess noise of the second start where the first plan does not refine


@dataclass(frozen=True)
class Plan:
    """What solving gave: the trajectory, how good it really is, and what it took."""

    task: Task
    model: Model
    wishes: tuple[Wish, ...]
    trajectory: Trajectory
    certificate: Certificate
    status: str
    sentence: str
    cost: dict[str, float]
    attempts: tuple[Attempt, ...]
    solve_s: float
    solve_cpu_s: float
    build_s: float
    variables: int
    constraints: int
    relax: tuple[Relax, ...] = ()
    refined: bool = False

    @property
    def iterations(self) -> int:
        """IPOPT iterations over all solves."""
        return sum(a.iterations for a in self.attempts)


@dataclass
class Planner:
    """Builds programs of one task on demand and solves them by a list of strategies."""

    task: Task
    model: Model
    wishes: list[Wish]
    log: Path | None = None
    tell: Callable[[str], None] = lambda text: None
    watch: Watch | None = None
    attempts: list[Attempt] = field(default_factory=list)
    build_s: float = 0.0
    build_cpu_s: float = 0.0
    deadline: float = np.inf
    start: Trajectory | None = None
    stop: Callable[[], bool] | None = None
    outcome: Outcome | None = None  # of the elastic solve after a failure

    def search(self, nodes: int, reduction: Reduction) -> Search:
        """A fresh program on a grid of `nodes`."""
        started, busy = time.perf_counter(), time.process_time()
        transcription = Transcription(self.model, self.task, self.wishes, reduction, nodes)
        options = {"max_iter": self.task.solver.max_iterations, **self.task.solver.options}
        ipopt = Ipopt(transcription, options, self.log, self.deadline, self.watch, self.stop)
        self.build_s += time.perf_counter() - started
        self.build_cpu_s += time.process_time() - busy
        name = "half" if reduction.symmetric else "whole"

        def tell(text: str) -> None:
            self.tell(f"{text} ({name} robot, {nodes} nodes)")

        return Search(ipopt, self.task.solver.complementarity, tell, self.attempts)

    def guess(self, transcription: Transcription) -> Point:
        """The automatic start guess on a program's grid."""
        t = transcription
        return Point(automatic_guess(self.model, self.task, self.wishes, t.layout, t.nodes))

    def reductions(self) -> Iterator[Reduction]:
        """Half robot first where model and task are mirror images of themselves."""
        if self.task.solver.symmetry:
            half = find_symmetry(self.model)
            if half is not None and wishes_are_symmetric(self.model, self.wishes):
                yield half
        yield whole(self.model.node)

    def strategies(self) -> Iterator[Callable[[], tuple[Transcription, Point]]]:
        """Ways to a plan, the quickest first; from the given start before any guess."""
        nodes = self.task.nodes
        for reduction in self.reductions() if self.start is not None else ():
            yield lambda r=reduction: self._continued(r)  # type: ignore[misc]
        for reduction in self.reductions():
            if self.task.solver.coarse and nodes // 2 >= COARSEST:
                yield lambda r=reduction: self._coarse_to_fine(r)  # type: ignore[misc]
            yield lambda r=reduction: self._direct(r)  # type: ignore[misc]

    def _coarse_to_fine(self, reduction: Reduction) -> tuple[Transcription, Point]:
        coarse = self.search(self.task.nodes // 2, reduction)
        point = self._polished(coarse, find(coarse, self.guess(coarse.transcription)))
        if not point.solved:
            return coarse.transcription, point
        fine = self.search(self.task.nodes, reduction)
        return self._finish(fine, refine(fine, coarse.transcription, point))

    def _direct(self, reduction: Reduction) -> tuple[Transcription, Point]:
        search = self.search(self.task.nodes, reduction)
        point = find(search, self.guess(search.transcription))
        return self._finish(search, self._polished(search, point))

    def _continued(self, reduction: Reduction) -> tuple[Transcription, Point]:
        assert self.start is not None
        search = self.search(self.task.nodes, reduction)
        point = binary(search, resumed(search.transcription, self.start))
        return self._finish(search, self._polished(search, point))

    def _polished(self, search: Search, point: Point) -> Point:
        if not point.solved:
            return point
        return polish(search, point) if self.task.solver.polish else fix(search, point)

    def _finish(self, search: Search, point: Point) -> tuple[Transcription, Point]:
        point = tighten(search, point) if point.solved else point
        if not point.solved or not search.transcription.reduction.symmetric:
            return search.transcription, point
        full = self.search(self.task.nodes, whole(self.model.node))
        return full.transcription, confirm(full, search.transcription, point)

    def penalty(self) -> tuple[Transcription, Point]:
        """The paper's way, on the whole robot."""
        search = self.search(self.task.nodes, whole(self.model.node))
        start = self.guess(search.transcription)
        return search.transcription, penalise(search, start, self.task.method)

    def run(self) -> tuple[Transcription, Point]:
        """The first strategy that solves, else where the first one ended; a stop keeps its
        iterate."""
        try:
            if self.task.method in WEIGHTS:
                return self.penalty()
            first = None
            for strategy in self.strategies():
                found = strategy()
                if found[1].solved:
                    return found
                first = first or found
                if self.attempts[-1].name == RELAX and self.outcome is None:
                    self.outcome = elastic(self, next(self.reductions()))
                    if self.outcome is not None and self.outcome.short:
                        return first
            assert first is not None
            self.outcome = self.outcome or elastic(self, next(self.reductions()))
            return first
        except Stopped as stop:
            return stop.transcription, stop.point

    def refuse(self) -> tuple[Transcription, Point]:
        """Nothing solved: the start guess, for a task that a check refused."""
        whole_robot = whole(self.model.node)
        program = Transcription(self.model, self.task, self.wishes, whole_robot, self.task.nodes)
        return program, replace(self.guess(program), message="Infeasible_Problem_Detected")


def task_model(task: Task, name: str | Path | None = None) -> Model:
    """The model of a task: its own unless `name` is given, with the task's supply and payload."""
    extra = [Payload(m=task.payload)] if task.payload else []
    return load_model(name or task.model, extra, task.supply)


def plan(
    task: Task,
    document: Document | None = None,
    model: str | Path | None = None,
    log: Path | None = None,
    tell: Callable[[str], None] = lambda text: None,
    watch: Watch | None = None,
    start: Trajectory | None = None,
    stop: Callable[[], bool] | None = None,
) -> Plan:
    """Solve a task. Never raises for a task that cannot be met: the status says so.

    Raises ConfigErrors for wrong names, units and solver options. `log` collects IPOPT's text,
    `tell` hears what is being done, `watch` every iteration; `start` is a trajectory to go on
    from, `stop` is asked between iterations whether to end with the best one.
    """
    document = document or Document(task.model_dump())
    started = time.perf_counter()
    built = task_model(task, model)
    wishes = resolve(task, built, document)
    planner = Planner(task, built, wishes, log, tell, watch, start=start, stop=stop)
    findings = check_task(task, built, wishes, document)
    refused = refusal(findings)
    planner.build_s = time.perf_counter() - started
    planner.deadline = time.monotonic() + task.solver.time_limit
    found = searched(planner, refused is not None)
    if found.status == "solved" and task.refine == "radau":
        return refined(planner, found)
    if found.status in ("solved", "acceptable", "interrupted"):
        return found
    why = refused or explanation(task, built, planner.outcome, findings, document)
    return found if why is None else explained(found, why)


def searched(planner: Planner, refused: bool) -> Plan:
    """What the strategies find, judged; the start guess for a task that a check refused."""
    started, busy = time.perf_counter(), time.process_time()
    build_before = planner.build_s
    build_cpu_before = planner.build_cpu_s
    transcription, point = planner.refuse() if refused else planner.run()
    elapsed = time.perf_counter() - started - (planner.build_s - build_before)
    busy = time.process_time() - busy - (planner.build_cpu_s - build_cpu_before)
    trajectory = to_trajectory(transcription, point.Y)
    return judge(planner, transcription, trajectory, point, elapsed, busy)


def refined(planner: Planner, found: Plan) -> Plan:
    """The plan on its own phases; where that fails, another start's, which often differs little
    and yet refines. Not on a whole robot, where one failure takes long enough."""
    first = on_phases(planner, found)
    half = next(planner.reductions()).symmetric and planner.start is None
    if first.refined or first.status != "solved" or not half:
        return first
    task = planner.task
    nudged = {"guess_noise": max(task.guess_noise, NUDGE), "seed": task.seed + 1}
    planner.task = task.model_copy(update=nudged)
    second = searched(planner, False)
    planner.task = task
    if second.status == "solved":
        second = on_phases(planner, replace(second, task=task))
    if second.status == "interrupted":
        first = replace(first, status="interrupted")
    best = second if second.refined else first
    return replace(
        best,
        attempts=tuple(planner.attempts),
        solve_s=first.solve_s + second.solve_s,
        solve_cpu_s=first.solve_cpu_s + second.solve_cpu_s,
    )


def on_phases(planner: Planner, found: Plan) -> Plan:
    """The plan solved again on its own phases; where that fails, the same with the reason."""
    started, busy = time.perf_counter(), time.process_time()
    task, model = found.task, found.model
    planner.tell("phases")
    answer = solve_phases(
        model,
        task,
        found.wishes,
        found.trajectory,
        deadline=planner.deadline,
        log=planner.log,
        watch=planner.watch,
        stop=planner.stop,
    )
    planner.attempts.append(Attempt("phases", answer.message, answer.iterations))
    found = replace(
        found,
        attempts=tuple(planner.attempts),
        solve_s=found.solve_s + time.perf_counter() - started,
        solve_cpu_s=found.solve_cpu_s + time.process_time() - busy,
    )
    new, certificate = answer.trajectory, answer.certificate
    if answer.stopped:
        kept = "interrupted while refining, the implicit Euler plan is kept"
        return replace(found, status="interrupted", sentence=f"{found.sentence}; {kept}")
    if new is None or certificate is None or not certificate.within(task.tolerances):
        kept = f"not refined ({answer.message}), the implicit Euler plan is kept"
        return replace(found, sentence=f"{found.sentence}; {kept}")
    status, sentence = verdict(task, certificate, new, answer.message)
    return replace(
        found,
        trajectory=new,
        certificate=certificate,
        status=status,
        sentence=f"{sentence}, refined on {len(answer.phases)} phases",
        cost=costs(model, new),
        refined=True,
    )


def explained(found: Plan, why: Explanation) -> Plan:
    """The same with the reason: what is proven replaces the solver's status and words."""
    if not why.proven:
        return replace(found, sentence=f"{found.sentence}; {why.sentence}")
    return replace(found, status="infeasible", sentence=why.sentence, relax=why.relax)


def program_size(task: Task, document: Document, model: str | Path | None = None) -> dict[str, int]:
    """Variables and rows of the whole program of a task, everything checked, nothing solved."""
    built = task_model(task, model)
    wishes = resolve(task, built, document)
    transcription = Transcription(built, task, wishes, whole(built.node), task.nodes)
    return {"variables": transcription.variables, "constraints": transcription.constraints}


def judge(
    planner: Planner,
    transcription: Transcription,
    trajectory: Trajectory,
    point: Point,
    solve_s: float,
    solve_cpu_s: float,
) -> Plan:
    """Certificate, status and sentence of what was found."""
    certificate = certify(planner.model, planner.task, planner.wishes, trajectory)
    status, sentence = verdict(planner.task, certificate, trajectory, point.message)
    return Plan(
        task=planner.task,
        model=planner.model,
        wishes=tuple(planner.wishes),
        trajectory=trajectory,
        certificate=certificate,
        status=status,
        sentence=sentence,
        cost=costs(planner.model, trajectory),
        attempts=tuple(planner.attempts),
        solve_s=solve_s,
        solve_cpu_s=solve_cpu_s,
        build_s=planner.build_s,
        variables=transcription.variables,
        constraints=transcription.constraints,
    )
