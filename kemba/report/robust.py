"""Robust planning: of several plans of a task, the one that succeeds in most scenarios."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from kemba.model import Model
from kemba.ocp import Plan, Task
from kemba.ocp.certificate.status import Status
from kemba.plant.stepping.family import share_equations
from kemba.report.judging.executed import Executed
from kemba.report.judging.judged import judged, plant_of, table_of
from kemba.report.robust_ways import WAYS, Changed, RobustSettings, variants
from kemba.scenarios.draw import Scenario, scenarios
from kemba.scenarios.share import Share, outcomes, share, share_of
from kemba.trajectory import Trajectory

Solve = Callable[[Task], Plan]
Change = Callable[[Plan, Task], Plan | None]
Way = Callable[[Plan, Sequence[Scenario]], Changed]


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

    def succeeds(self, least: float) -> bool:
        """Whether it is solved and good, and succeeds in a share of `least` or more."""
        if self.share is None or not self.rank[0] or not self.good:
            return False
        return self.share.landed >= least * self.share.n

    @property
    def poor(self) -> bool:
        """Whether it was executed and seldom succeeds."""
        return self.share is not None and is_poor(self.share)

    @property
    def enough(self) -> bool:
        """Whether it succeeds so often that no plan is sought anew."""
        return self.succeeds(RobustSettings.current().enough)


def most_robust(
    task: Task, solve: Solve, change: Change, tell: Callable[[str], None]
) -> RobustCandidate:
    """The plan that succeeds in most of `task.robust` scenarios of `task.uncertainties`.

    `solve` plans a task; `change` continues a plan for a changed task, None where that fails. Each
    plan is executed with its own hold and with a longer one. Where none is found, the first failed
    one. Raises KembaError where the plant or the uncertainties are wrong.
    """
    plant = plant_of(task)
    cases = scenarios(task.uncertainties, plant, task.robust)
    share_equations(case.model for case in cases)  # few of them are executed first
    search = _Search(plant, cases, tell)
    first = solve(task)
    search.take("as asked", first)
    for way in search.ways if first.status.plan else ():
        search.along(way, first, change)
    for name, variant in variants(task):
        if search.over or (search.best and search.best.enough):
            break
        search.take(name, solve(variant))
    return search.whole() or RobustCandidate(first)


@dataclass
class _Search:
    """The best candidate so far; `over` where no other is to be tried."""

    plant: Model
    cases: list[Scenario]
    tell: Callable[[str], None]
    best: RobustCandidate | None = field(default=None)
    over: bool = False

    @property
    def ways(self) -> Sequence[Sequence[Way]]:
        """In which order a plan is changed: one that seldom succeeds by what changes most first."""
        return WAYS[::-1] if self.best and self.best.poor else WAYS

    def along(self, way: Sequence[Way], found: Plan, change: Change) -> None:
        """Execute a plan after each change of a way that it needs, as far as that goes."""
        for step in way:
            changed = None if self.over else step(found, self.cases)
            if changed is None:
                continue
            name, task = changed
            new = change(found, task)
            if new is None:
                self.tell(f"{name}: no plan")
                return
            found = replace(new, sentence=f"{new.sentence}; {name}")
            self.take(name, found)

    def take(self, name: str, found: Plan) -> None:
        """Execute a plan in all scenarios, with its own hold and with a longer one."""
        self.over = found.status is Status.INTERRUPTED
        if self.over or not found.status.plan:
            return
        own = found.task.hold
        for hold in sorted({own, max(own, RobustSettings.current().hold)}):
            held = replace(found, task=found.task.model_copy(update={"hold": hold}))
            table = table_of(held)
            landed = self._share(held, table)
            self.tell(f"{name}, hold {hold:g} s: {landed.sentence}")
            one = RobustCandidate(held, table, landed, judged(held, table, self.plant).good)
            if self.best is None or one.rank > self.best.rank:
                self.best = one
            if self.best.succeeds(1.0):  # continued plans take seconds
                self.over = True
                return

    def _share(self, found: Plan, table: Trajectory) -> Share:
        """The share of scenarios in which a table succeeds; of the first few where it is poor."""
        few = RobustSettings.current().few
        done = outcomes(found.model, found.trajectory, table, self.cases[:few])
        if not is_poor(share_of(done)):
            done += outcomes(found.model, found.trajectory, table, self.cases[few:])
        return share_of(done)

    def whole(self) -> RobustCandidate | None:
        """The best candidate, with its share of all scenarios."""
        best = self.best
        if not best or not best.table or not best.share or best.share.n == len(self.cases):
            return best
        landed = share(best.plan.model, best.plan.trajectory, best.table, self.cases)
        return replace(best, share=landed)


def is_poor(found: Share) -> bool:
    """Whether a plan succeeds so seldom that no further scenario is worth its time."""
    return found.landed < RobustSettings.current().poor * found.n


def with_share(found: Executed) -> Executed:
    """A plan that was made again after its share was taken, with its own; the same where it has no
    table. Raises KembaError where the plant or the uncertainties are wrong."""
    plan, table = found.plan, found.motions.table
    if table is None:
        return found
    cases = scenarios(plan.task.uncertainties, plant_of(plan.task), plan.task.robust)
    landed = share(plan.model, plan.trajectory, table, cases)
    sentence = f"{found.result['sentence']}; {landed.sentence}"
    result = {**found.result, "robust": landed.summary(), "sentence": sentence}
    return replace(found, result=result)
