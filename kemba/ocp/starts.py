"""Several starts on the cores, the best plan kept."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path

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
) -> Plan:
    """The cheapest of `starts` plans from noisy guesses, `jobs` at a time (default: the cores).

    The best one is solved once more from its own guess in this process: a plan's functions do not
    travel between processes. Raises as `plan` does.
    """
    tasks = [
        task.model_copy(update={"guess_noise": max(task.guess_noise, NOISE * (i > 0)), "seed": i})
        for i in range(starts)
    ]
    found: list[Start] = []
    workers = min(jobs or os.cpu_count() or 1, starts)
    with ProcessPoolExecutor(workers, get_context("spawn"), load_effects, (BY_KIND.files,)) as pool:
        futures = [pool.submit(_start, one) for one in tasks]
        try:
            for future in as_completed(futures):
                start = future.result()
                found.append(start)
                tell(f"start {start.seed}: {start.status}, cost {start.cost:.4g}")
        except KeyboardInterrupt:
            pool.shutdown(wait=False, cancel_futures=True)
    solved = [s for s in found if s.status is Status.SOLVED]
    if not solved:
        return plan(task, document, log=log, tell=tell)
    best = min(solved, key=lambda s: s.cost)
    return replace(plan(tasks[best.seed], document, log=log, tell=tell), task=task)


def _start(task: Task) -> Start:
    found = plan(task)
    cost = objective(found.model, task, found.requirements, found.trajectory)
    return Start(task.seed, found.status, cost)
