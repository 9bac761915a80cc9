"""Robust planning: of several plans of a task, the one that succeeds in most scenarios."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from kemba.ocp import Plan, Task
from kemba.ocp.certificate.status import Status
from kemba.report.judging.judged import judged, plant_of, table_of
from kemba.scenarios.draw import scenarios
from kemba.scenarios.share import Share, share
from kemba.settings import Settings, setting
from kemba.trajectory import Trajectory

TRIALS = "tuned: by hand on jumps of 0.36 to 0.9 m (docs/tasks.md), no benchmark"


class RobustSettings(Settings):
    """Which plans are tried, and when one is good enough."""

    enough: float = setting(0.98, "1", "share of scenarios at which no other plan is tried", TRIALS)
    hold: float = setting(
        0.3, "s", "hold of a plan whose task has none",
        "derived: a robot that was put down askew has settled by then (docs/tasks.md)",
    )  # fmt: skip
    air: float = setting(0.3, "1", "cost of open valves of a candidate that has less", TRIALS)
    noise: float = setting(0.1, "1", "guess noise of other starts", TRIALS)
    starts: int = setting(1, "1", "other starts", "convention: three times a plain plan at most")


@dataclass(frozen=True)
class RobustCandidate:
    """A plan; with its controller table and the share of scenarios in which it succeeds, if it was
    executed. `good`: its executions keep to the task's tolerances."""

    plan: Plan
    table: Trajectory | None = None
    share: Share | None = None
    good: bool = False

    @property
    def rank(self) -> tuple[bool, bool, int, float]:
        """Better candidates are greater: solved, good on the plant, then by share, by cost."""
        solved = self.plan.status is Status.SOLVED
        landed = self.share.landed if self.share else 0
        return solved, self.good, landed, -self.plan.cost["torque_squared_integral"]

    @property
    def enough(self) -> bool:
        """Whether it succeeds so often that no other plan is tried."""
        least = RobustSettings.current().enough
        if self.share is None or not self.rank[0] or not self.good:
            return False
        return self.share.landed >= least * self.share.n


def variants(task: Task) -> Iterator[tuple[str, Task]]:
    """The task as asked for, then the same motion sought in other ways."""
    settings = RobustSettings.current()
    held = task.model_copy(update={"hold": max(task.hold, settings.hold)})
    yield "as asked", task
    if task.cost.get("air", 0.0) < settings.air:
        yield "less air", held.model_copy(update={"cost": {**task.cost, "air": settings.air}})
    for seed in range(1, settings.starts + 1):
        guess = {"guess_noise": max(task.guess_noise, settings.noise), "seed": task.seed + seed}
        yield f"start {seed + 1}", held.model_copy(update=guess)


def most_robust(
    task: Task, solve: Callable[[Task], Plan], tell: Callable[[str], None]
) -> RobustCandidate:
    """The plan that succeeds in most of `task.robust` scenarios of `task.uncertainties`.

    Each plan is executed with its own hold and with a longer one. Where none is found, the first
    failed one. Raises KembaError where the plant or the uncertainties are wrong.
    """
    settings = RobustSettings.current()
    plant = plant_of(task)
    cases = scenarios(task.uncertainties, plant, task.robust)
    best: RobustCandidate | None = None
    failed: Plan | None = None
    for name, variant in variants(task):
        found = solve(variant)
        if found.status is Status.INTERRUPTED or not found.status.plan:
            failed = failed or found
            if found.status is Status.INTERRUPTED:
                break
            continue
        for hold in sorted({variant.hold, max(variant.hold, settings.hold)}):
            held = replace(found, task=variant.model_copy(update={"hold": hold}))
            table = table_of(held)
            landed = share(held.model, held.trajectory, table, cases)
            tell(f"{name}, hold {hold:g} s: {landed.sentence}")
            one = RobustCandidate(held, table, landed, judged(held, table, plant).good)
            if best is None or one.rank > best.rank:
                best = one
            if best.enough:
                return best
    if best is not None:
        return best
    assert failed is not None
    return RobustCandidate(failed)
