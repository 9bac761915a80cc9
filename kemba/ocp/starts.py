"""Several starts on the cores, the best plan kept."""

import os
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from kemba.config import Document
from kemba.effects import BY_KIND, load_effects
from kemba.ocp.certificate.objective import objective
from kemba.ocp.certificate.status import Status
from kemba.ocp.planned import Plan
from kemba.ocp.planning import plan
from kemba.ocp.task.task import Task

NOISE = 0.25  # of the guess of all starts but the first: of every scale, so that minima differ


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
        task.model_copy(update={"guess_noise": max(task.guess_noise, NOISE * (i > 0)), "seed": i})
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
    cost = objective(found.model, task, found.requirements, found.trajectory)
    return Start(task.seed, found.status, cost)
