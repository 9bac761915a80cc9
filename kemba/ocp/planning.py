"""From a task to certified plans: checked, solved, refined; or why there is none. Several starts go
on side by side on the cores, and the best plan is kept."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field, replace
from functools import cached_property
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from kemba.config import Document
from kemba.effects import BY_KIND, load_effects
from kemba.errors import KembaError
from kemba.model import Model
from kemba.model.lags import with_lags
from kemba.ocp.certificate.status import Status
from kemba.ocp.continuation.origin import Origin
from kemba.ocp.finer import Judge, continued, found_and_refined, from_scratch, with_grip
from kemba.ocp.infeasibility.checks import check_task
from kemba.ocp.infeasibility.explain import Diagnostic, Explanation, explanation, refusal
from kemba.ocp.nlp.ipopt import Control, Watch
from kemba.ocp.planned import Plan, clear, explained
from kemba.ocp.planner import Planner
from kemba.ocp.reading import as_one, asked_of, motions
from kemba.ocp.refinement import Order, order_of
from kemba.ocp.relaxation.schedule import PENALTIES
from kemba.ocp.relaxation.session import Session
from kemba.ocp.sides import on_level_ground
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.task import Task
from kemba.ocp.transcription.symmetry import whole
from kemba.ocp.transcription.transcribe import Transcription
from kemba.stopwatch import Stopwatch, Tell, silent
from kemba.trajectory import Trajectory

LEFT = "its executions miss what the task allows"  # why a plan was not the last one


@dataclass(frozen=True)
class Planning:
    """A task that is being planned: its plans from one start after the other, one time limit.

    `clock` counts all of it, `planner.session.building` what was spent before and between solves.
    """

    document: Document
    planner: Planner
    clock: Stopwatch

    @classmethod
    def of(
        cls,
        task: Task,
        document: Document | None = None,
        model: str | Path | None = None,
        log: Path | None = None,
        tell: Tell = silent,
        watch: Watch | None = None,
        start: Trajectory | None = None,
        stop: Callable[[], bool] | None = None,
        deadline: float = np.inf,
    ) -> Planning:
        """The planning of a task. Raises ConfigErrors for wrong names, units and solver options.

        `log` collects IPOPT's text, `tell` gets the name of every solve, `watch` is called after
        every iteration; `start` is a trajectory to begin with; `stop` is asked after every
        iteration whether to end. All is over at the `deadline` by `time.monotonic` [s] at the
        latest.
        """
        document = document or Document(task.model_dump())
        deadline = min(deadline, time.monotonic() + task.solver.time_limit)
        building, clock = Stopwatch(), Stopwatch()
        with building.running(), clock.running():
            asked = task
            if task.sequence:
                task, built, requirements = as_one(asked, document)
            else:
                built, requirements = asked_of(asked, document, model)
            lags: tuple[Model, list[Requirement]] | None = None
            if task.refine == "radau" and start is None and with_lags(built) is not None:
                many = as_one(asked, document, lags=True)[1:] if asked.sequence else None
                lags = many or asked_of(asked, document, model, lags=True)
        session = Session(Control(deadline, log, watch, stop), tell, building=building)
        return cls(document, Planner(task, built, requirements, session, start, lags=lags), clock)

    @property
    def over(self) -> bool:
        """Whether the user or the time limit has ended it."""
        return self.planner.session.control.ended() is not None

    @cached_property
    def diagnostics(self) -> Sequence[Diagnostic]:
        """What certainly cannot be met."""
        p = self.planner
        with self.clock.running(), p.session.building.running():
            return check_task(p.task, p.model, p.requirements, self.document)

    @property
    def refused(self) -> Explanation | None:
        """Why there is no plan to be sought."""
        return refusal(self.diagnostics)

    def plans(self, origin: Origin | None = None) -> Iterator[Plan]:
        """Plans of the task, made when asked for: from an earlier plan, then from one guess after
        the other, unless it is proven that there is none; none whose contacts and valves come in
        the order of an earlier one, as the same program would refine it. In a scene with walls the
        guesses are followed on level ground, and one in the scene itself comes last."""
        failed = ""
        if origin is not None and self.refused is None:
            near, failed = self.continued(origin)
            if near is not None:
                yield near
                if self.over:
                    return
                failed = LEFT
            failed = failed if origin.given else ""
        task, planner, orders = self.planner.task, self.planner, _Orders()
        free = planner.start is None and self.refused is None
        walls = free and on_level_ground(planner.seeking) is not None
        another = free and task.method not in PENALTIES  # the paper's way is one solve
        missed: Plan | None = None
        for number, guess in enumerate(guesses(task, planner.model, walls)):
            if number and self.over:
                break
            if number:
                planner.session.tell("another guess")
            own = guess if planner.start is None else replace(guess, pulse=0.0)
            found = self._from_guess(own, orders.new)
            if found is None:
                continue
            start = f"guess {number + 1}" if number else found.start
            nothing = not (found.status.plan or found.status is Status.INTERRUPTED)
            if nothing and (guess.level or (another and not found.relax)):
                missed = replace(found, start=start)
                continue
            orders.keep(found)
            missed = None
            for each, how in ((found, ""), (found.plain, ", without further pulses")):
                if each is not None:
                    told = from_scratch(each, failed) if failed else each
                    yield replace(told, start=f"{start}{how}")
            only = planner.start is not None or task.refine != "radau"
            if only or not found.status.plan:
                return
        if missed is not None:
            yield missed

    def continued(self, origin: Origin) -> tuple[Plan | None, str]:
        """The task's plan from another one, or None and the reason where that fails."""
        with self.clock.running():
            found, why = continued(self.planner, origin)
        return found and self._timed(found), why

    def _from_guess(self, guess: StartGuess, new: Judge) -> Plan | None:
        """The plan from a guess; None where it is not `new`."""
        refused = self.refused
        task = self.planner.task
        begins = task.model_copy(update=guess.update)
        lags = self.planner.lags if guess.lags else None
        planner = replace(self.planner, task=begins, outcome=None, lags=lags)
        planner = replace(planner, pulse=guess.pulse, level=guess.level)
        with self.clock.running():
            made = found_and_refined(planner, refused is not None, new)
            if made is None:
                return None
            found = replace(made, task=task)
            if found.status is Status.SOLVED and task.grip < 1.0:
                found = replace(with_grip(self.planner, found), plain=None)
        if not found.status.plan and found.status is not Status.INTERRUPTED:
            own = task, planner.model, planner.outcome, self.diagnostics, self.document
            why = refused or explanation(*own)
            found = found if why is None else explained(found, why)
        plain = found.plain and self._timed(self._clear(replace(found.plain, task=task)))
        return replace(self._timed(self._clear(found)), plain=plain)

    def _clear(self, found: Plan) -> Plan:
        asked = found.status is Status.SOLVED and self.planner.task.clearance
        return clear(found) if asked else found

    def _timed(self, found: Plan) -> Plan:
        """A plan with all solves and times up to it."""
        clock, session = self.clock, self.planner.session
        return replace(
            found,
            attempts=tuple(session.attempts),
            solve_s=clock.wall - session.building.wall,
            solve_cpu_s=clock.cpu - session.building.cpu,
            build_s=session.building.wall,
        )


@dataclass
class _Orders:
    """In which orders contacts and valves of refined plans come."""

    known: list[Order] = field(default_factory=list)
    last: Order | None = None

    def new(self, found: Plan) -> bool:
        """Whether a plan that is not refined yet has another order than the refined ones."""
        self.last = order_of(found.model, found.task, found.requirements, found.trajectory)
        return self.last not in self.known

    def keep(self, found: Plan) -> None:
        """The last order is known if its plan was refined."""
        if found.refined and self.last is not None:
            self.known.append(self.last)


def plan(
    task: Task, document: Document | None = None, origin: Origin | None = None, **how: Any
) -> Plan:
    """Solve a task. Never raises for a task that cannot be met: the status says so.

    `how`: what `Planning.of` takes. `origin`: an earlier plan that is solved again for the changed
    figures; where that fails, the plan is made from scratch, and `Plan.continued` is False. Raises
    ConfigErrors for wrong names, units and solver options.
    """
    first: Plan | None = None
    for found in Planning.of(task, document, **how).plans(origin):
        first = first or found
        if found.status is Status.SOLVED:
            return found
    assert first is not None
    ended = Status.INTERRUPTED if found.status is Status.INTERRUPTED else first.status
    return replace(spent(first, found), status=ended)


def spent(old: Plan, new: Plan) -> Plan:
    """A plan with the solves and times up to a later one."""
    taken = ("attempts", "solve_s", "solve_cpu_s", "build_s")
    return replace(old, **{name: getattr(new, name) for name in taken})


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
    """Variables and rows of the whole program of a task, everything checked, nothing solved. Raises
    KembaError as `check_feasible` does."""
    built, requirements = check_feasible(task, document, model)
    if task.sequence:
        task, built, requirements = as_one(task, document)
    transcription = Transcription(built, task, requirements, whole(built.node), task.nodes)
    return {"variables": transcription.variables, "constraints": transcription.constraints}


# noise of a further guess, of every scale: enough for another plan, too little for a strange one
NOISE = 0.05
OTHERS = 2  # further guesses at most: each costs as much as the first


@dataclass(frozen=True)
class StartGuess:
    """A start guess with `noise` drawn by `seed`, and the shortest `pulse` [s] of a valve that is
    sought from it; `lags`: by first-order chambers, where the model has physical ones; `level`: on
    level ground, with sides for walls."""

    pulse: float
    noise: float
    seed: int
    lags: bool = True
    level: bool = False

    @property
    def update(self) -> dict[str, Any]:
        """What a task has instead, so that it begins here."""
        return {"guess_noise": self.noise, "seed": self.seed}


def guesses(task: Task, model: Model, walls: bool = False) -> Sequence[StartGuess]:
    """The guesses of a task; `walls`: its scene has some.

    A relaxed valve is open in part; rounded on a grid it opens and closes from node to node. Pulses
    that are shorter than the filling of a chamber move the leg little, and plans with many of them
    have no neighbours without. So they are left out first, and taken only where that gives no plan.
    Physical chambers are sought with themselves only where first-order ones led to no good plan.
    """
    fill = max(model.mechanism.need_cylinder().fill)
    longer = max(fill, task.min_dwell)
    first = StartGuess(longer, task.guess_noise, task.seed)
    direct = [replace(first, lags=False)] if with_lags(model) is not None else []
    found = [first, *direct, replace(first, pulse=task.min_dwell)]
    noise = max(task.guess_noise, NOISE)
    found += [StartGuess(longer, noise, task.seed + k) for k in range(1, OTHERS + 1)]
    level = [replace(guess, level=True) for guess in found] if walls else []
    return list(dict.fromkeys([*level, first] if walls else found))


SPREAD = 0.25  # of the guess of all starts but the first: of every scale, so that minima differ


@dataclass(frozen=True)
class Start:
    """How one start ended."""

    seed: int
    status: Status
    cost: float


def plan_best(
    task: Task,
    document: Document,
    starts: int,
    jobs: int | None = None,
    log: Path | None = None,
    tell: Callable[[str], None] = lambda text: None,
    deadline: float = np.inf,
) -> Plan:
    """The cheapest of `starts` plans from noisy guesses, `jobs` at a time (default: the cores).

    The best one is solved once more from its own guess in this process: a plan's functions do not
    travel between processes. Half of the time up to the `deadline` is kept for that. Raises as
    `plan` does.
    """
    half = (time.monotonic() + min(deadline, time.monotonic() + task.solver.time_limit)) / 2.0
    tasks = [
        task.model_copy(update={"guess_noise": max(task.guess_noise, SPREAD * (i > 0)), "seed": i})
        for i in range(starts)
    ]
    found: list[Start] = []
    workers = min(jobs or os.cpu_count() or 1, starts)
    with ProcessPoolExecutor(workers, get_context("spawn"), load_effects, (BY_KIND.files,)) as pool:
        futures = [pool.submit(_start, one, half) for one in tasks]
        try:
            for future in as_completed(futures):
                start = future.result()
                found.append(start)
                tell(f"start {start.seed}: {start.status}, cost {start.cost:.4g}")
        except KeyboardInterrupt:
            pool.shutdown(wait=False, cancel_futures=True)
    solved = [s for s in found if s.status is Status.SOLVED]
    if not solved:
        return plan(task, document, log=log, tell=tell, deadline=deadline)
    best = min(solved, key=lambda s: s.cost)
    again = plan(tasks[best.seed], document, log=log, tell=tell, deadline=deadline)
    return replace(again, task=task)


def _start(task: Task, deadline: float) -> Start:
    if time.monotonic() >= deadline:
        return Start(task.seed, Status.LIMIT, np.inf)
    found = plan(task, deadline=deadline)
    return Start(task.seed, found.status, found.objective)
