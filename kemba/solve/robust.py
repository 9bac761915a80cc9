"""Robust planning: of several plans of a task, the one that succeeds in most scenarios."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from kemba.model import Model
from kemba.ocp import Plan, Task
from kemba.ocp.certificate.status import Status
from kemba.plant.equations import share_equations
from kemba.scenarios.draw import Scenario, scenarios
from kemba.scenarios.share import ScenarioOutcome, Share, outcomes, share, share_of
from kemba.solve.judged import judged, plant_of, table_of
from kemba.solve.robust_ways import ENOUGH, FEW, HOLD, WAYS, Changed, variants
from kemba.solve.trial import Trial
from kemba.trajectory import Trajectory

Solve = Callable[[Task], Plan]
Change = Callable[[Plan, Task], Plan | None]
Way = Callable[[Plan, Sequence[Scenario]], Changed]


@dataclass(frozen=True)
class RobustCandidate:
    """A plan; if it was executed, with the controller's table and what that did in the scenarios so
    far. `good`: its executions keep to the task's tolerances."""

    plan: Plan
    name: str = ""
    table: Trajectory | None = None
    done: Sequence[ScenarioOutcome] = ()
    good: bool = False

    @property
    def share(self) -> Share | None:
        """The share of scenarios in which it succeeds, of those in which it was executed."""
        return share_of(self.done) if self.done else None

    @property
    def landed(self) -> float:
        """That share as a number."""
        return self.share.landed / self.share.n if self.share else 0.0

    @property
    def rank(self) -> tuple[bool, bool, float, float]:
        """Better candidates are greater: solved, good on the plant, then by share, by cost."""
        solved, cost = self.plan.status is Status.SOLVED, self.plan.cost["torque_squared_integral"]
        return solved, self.good, self.landed, -cost

    def succeeds(self, least: float) -> bool:
        """Whether it is solved and good, and succeeds in a share of `least` or more."""
        return self.rank[0] and self.good and self.landed >= least


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
    for way in WAYS if first.status.plan else ():
        search.along(way, first, change)
    for name, variant in variants(task):
        best = search.best()
        if search.over or (best and best.succeeds(ENOUGH)):
            break
        search.take(name, solve(variant))
    return search.best() or RobustCandidate(first)


@dataclass
class _Search:
    """The candidates so far; `over` where no other is to be tried."""

    plant: Model
    cases: list[Scenario]
    tell: Callable[[str], None]
    candidates: list[RobustCandidate] = field(default_factory=list)
    over: bool = False

    def along(self, way: Sequence[Way], found: Plan, change: Change) -> None:
        """Execute a plan after each change of a way, as far as it needs them."""
        for step in way:
            changed = None if self.over else step(found, self.cases)
            if changed is None:
                return
            name, task = changed
            new = change(found, task)
            if new is None:
                self.tell(f"{name}: no plan")
                return
            found = replace(new, sentence=f"{new.sentence}; {name}")
            self.take(name, found)

    def take(self, name: str, found: Plan) -> None:
        """Execute a plan in the first few scenarios, and in the others if it succeeds in all of
        these, with its own hold and with a longer one."""
        self.over = found.status is Status.INTERRUPTED
        if self.over or not found.status.plan:
            return
        own = found.task.hold
        for hold in sorted({own, max(own, HOLD)}):
            held = replace(found, task=found.task.model_copy(update={"hold": hold}))
            near = table_of(held)
            good = judged(held, near.table, self.plant, known=near.replay).good
            one = RobustCandidate(held, f"{name}, hold {hold:g} s", near.table, (), good)
            one = self._executed(one, FEW)
            if one.landed == 1.0:
                one = self._executed(one, len(self.cases))
            self.candidates.append(one)
            if one.succeeds(ENOUGH):
                self.over = True
                return

    def best(self) -> RobustCandidate | None:
        """The best candidate, executed in all scenarios."""
        while self.candidates:
            ranks = [one.rank for one in self.candidates]
            i = ranks.index(max(ranks))
            best = self.candidates[i]
            if len(best.done) == len(self.cases):
                return best
            self.candidates[i] = self._executed(best, len(self.cases))
        return None

    def _executed(self, one: RobustCandidate, until: int) -> RobustCandidate:
        """A candidate that is executed in the scenarios up to `until`."""
        left, plan = self.cases[len(one.done) : until], one.plan
        if not left or one.table is None:
            return one
        done = (*one.done, *outcomes(plan.model, plan.trajectory, one.table, left))
        self.tell(f"{one.name}: {share_of(done).sentence}")
        return replace(one, done=done)


def with_share(found: Trial) -> Trial:
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
