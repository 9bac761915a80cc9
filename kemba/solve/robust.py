"""Robust planning: of several plans of a task, the one that succeeds in most scenarios."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from kemba.effects.mechanics.ground import Contact
from kemba.model import Model
from kemba.ocp import Plan, Task, controller_table
from kemba.ocp.certificate.asked import grip_of
from kemba.ocp.certificate.status import Status
from kemba.plant.equations import share_equations
from kemba.plant.retiming import retimed
from kemba.scenarios.draw import Scenario, scenarios
from kemba.scenarios.share import ScenarioOutcome, Share, outcomes, share_of
from kemba.solve.judged import judged, plant_of
from kemba.solve.trial import Trial
from kemba.trajectory import Trajectory

Solve = Callable[[Task], Plan]
Change = Callable[[Plan, Task], Plan | None]


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
    task: Task, solve: Solve, change: Change, tell: Callable[[str], None], deadline: float = np.inf
) -> RobustCandidate:
    """The plan that succeeds in most of `task.robust` scenarios of `task.uncertainties`.

    `solve` plans a task; `change` continues a plan for a changed task, None where that fails. Each
    plan is executed with its own hold and with a longer one. Where none is found, the first failed
    one. After the `deadline` by `time.monotonic` [s] nothing more is tried. Raises KembaError where
    the plant or the uncertainties are wrong.
    """
    plant = plant_of(task)
    cases = scenarios(task.uncertainties, plant, task.robust)
    share_equations(case.model for case in cases)  # few of them are executed first
    search = _Search(plant, cases, tell, deadline)
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
    """The candidates so far; `done` where no other is to be tried."""

    plant: Model
    cases: list[Scenario]
    tell: Callable[[str], None]
    deadline: float
    candidates: list[RobustCandidate] = field(default_factory=list)
    done: bool = False

    @property
    def over(self) -> bool:
        """Whether no other is to be tried, or the time is over."""
        return self.done or time.monotonic() >= self.deadline

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
        self.done = found.status is Status.INTERRUPTED
        if self.done or not found.status.plan:
            return
        own = found.task.hold
        for hold in sorted({own, max(own, HOLD)}):
            held = replace(found, task=found.task.model_copy(update={"hold": hold}))
            table = controller_table(held.model, held.trajectory, hold)
            table = retimed(held.model, held.trajectory, table)
            good = judged(held, table, self.plant).good
            one = RobustCandidate(held, f"{name}, hold {hold:g} s", table, (), good)
            one = self._executed(one, FEW)
            if one.landed == 1.0:
                one = self._executed(one, len(self.cases))
            self.candidates.append(one)
            self.done = one.succeeds(ENOUGH)
            if self.over:
                return

    def best(self) -> RobustCandidate | None:
        """The best candidate, executed in all scenarios that the time was enough for."""
        while self.candidates:
            ranks = [one.rank for one in self.candidates]
            i = ranks.index(max(ranks))
            best = self.candidates[i]
            self.candidates[i] = new = self._executed(best, len(self.cases))
            if len(new.done) == len(best.done):
                return best
        return None

    def _executed(self, one: RobustCandidate, until: int) -> RobustCandidate:
        """A candidate that is executed in the scenarios up to `until`."""
        plan, done, until = one.plan, tuple(one.done), min(until, len(self.cases))
        while one.table is not None and len(done) < until and time.monotonic() < self.deadline:
            left = self.cases[len(done) : min(until, len(done) + FEW)]
            done += tuple(outcomes(plan.model, plan.trajectory, one.table, left))
        if len(done) > len(one.done):
            self.tell(f"{one.name}: {share_of(done).sentence}")
        return replace(one, done=done)


def with_share(found: Trial) -> Trial:
    """A plan that was made again after its share was taken, with its own; the same where it has no
    table. Raises KembaError where the plant or the uncertainties are wrong."""
    plan, table = found.plan, found.motions.table
    if table is None:
        return found
    cases = scenarios(plan.task.uncertainties, plant_of(plan.task), plan.task.robust)
    landed = share_of(outcomes(plan.model, plan.trajectory, table, cases))
    sentence = f"{found.result['sentence']}; {landed.sentence}"
    result = {**found.result, "robust": landed.summary(), "sentence": sentence}
    return replace(found, result=result)


Changed = tuple[str, Task] | None  # the changed task, and words for the sentence of its plan
Way = Callable[[Plan, Sequence[Scenario]], Changed]
# share of scenarios at which no other plan is sought; by hand on jumps of 0.36 to 0.9 m
# (docs/tasks.md), as AIR and NOISE
ENOUGH = 0.98
# scenarios in which a plan is executed first; in the others at once only if it succeeds in all of
# these: one that succeeds in 98 % does so three times in four, one of 90 % once in five
FEW = 15
HOLD = 0.3  # s; of a plan whose task has none: a robot that was put down askew has settled by then
# more time for a plan that takes all it has, as a share: a jump of 0.9 m, which has 0.84 s, takes
# 0.91 s where it may
LONGER = 0.15
FULL = 1e-3  # of the longest time, by which a plan that takes all of it is shorter at most
# m; more height of knees and hips above the ground, where the task asks for some: of jump_forward
# 95 % land with 5 cm under the knees, all of 120 with 8 to 11 cm (by hand)
ROOM = 0.05
AIR = 0.3  # cost of open valves of a candidate that has less
NOISE = 0.1  # guess noise of other starts
STARTS = 1  # other starts: three times a plain plan at most


def gripping(found: Plan, cases: Sequence[Scenario]) -> Changed:
    """What a plan is continued for where it leans on more friction than the scenarios have."""
    task, grip = found.task, least_grip(found.model, cases)
    if (grip_of(found.model, found.trajectory) or 0.0) <= grip:
        return None
    return f"on {grip:.0%} of the ground's friction", task.model_copy(update={"grip": grip})


def lifted(found: Plan, cases: Sequence[Scenario]) -> Changed:
    """What a plan is continued for where its task keeps knees or hips above the ground: that they
    keep off it by more, since a landing askew lowers one of them."""
    task = found.task
    bounds = {}
    for r in found.requirements:
        where, name = str(r.location[0]), str(r.location[-1])
        if where == "bounds" and r.quantity.name.endswith("/z") and np.isfinite(r.lower):
            bounds[name] = task.bounds[name].model_copy(update={"at_least": r.lower + ROOM})
    if not bounds:
        return None
    words = f"with {100 * ROOM:g} cm more room under knees and hips"
    return words, task.model_copy(update={"bounds": {**task.bounds, **bounds}})


def longer(found: Plan, cases: Sequence[Scenario]) -> Changed:
    """What a plan is continued for where it takes all the time that its task has."""
    task = found.task
    longest = task.duration * (1.0 + task.step_variation)
    if found.trajectory.time[-1] < longest * (1.0 - FULL):
        return None
    duration = task.duration * (1.0 + LONGER)
    words = f"with a duration of {duration:.3g} s instead of {task.duration:g} s"
    return words, task.model_copy(update={"duration": duration})


# in which order a plan is changed: first by what helps one that has no time to spare (of jumps of
# 0.8 and 0.82 m the others end there as well, after twice the time)
WAYS = ((longer, gripping), (lifted, gripping), (gripping,))


def variants(task: Task) -> Iterator[tuple[str, Task]]:
    """The same motion sought anew."""
    held = task.model_copy(update={"hold": max(task.hold, HOLD)})
    air = task.cost.get("air", 0.0)
    if isinstance(air, float) and air < AIR:
        yield "with less air", held.model_copy(update={"cost": {**task.cost, "air": AIR}})
    for seed in range(1, STARTS + 1):
        guess = {"guess_noise": max(task.guess_noise, NOISE), "seed": task.seed + seed}
        yield "from another start", held.model_copy(update=guess)


def least_grip(model: Model, cases: Sequence[Scenario]) -> float:
    """The share of the friction of `model` that the ground has in all scenarios but those that
    need not succeed; 1 where it varies in none."""
    own = _friction(model)
    there = [f for f in (_friction(case.model) for case in cases) if f is not None]
    if not own or not there:
        return 1.0
    sure = float(np.quantile(there, 1.0 - ENOUGH))
    return min(1.0, sure / own)


def _friction(model: Model) -> float | None:
    ground = next((e for e in model.effects if isinstance(e, Contact)), None)
    return None if ground is None else float(ground.value("mu"))
