"""What is changed in a plan that its executions do not confirm, one thing after the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from kemba.errors import KembaError
from kemba.ocp import Task
from kemba.ocp.phases.settings import Refining
from kemba.ocp.reading import task_model
from kemba.plant.execution.fitted_air import FittedAir, fitted_air
from kemba.report.judging.executed import Executed
from kemba.settings import Settings, setting


class RemedySettings(Settings):
    """The pulse that presses legs to their stops, and how often fits and guesses are tried."""

    air: float = setting(
        0.01, "s", "how long extending valves open", "convention: as in the shipped plans with it"
    )
    nearer: float = setting(
        0.8, "1", "times the least earlier error of the touchdown that another fit must leave at "
        "most", "tuned: jumps of 0.8 m and more, of which eight fits in a row brought none nearer",
    )  # fmt: skip
    guesses: int = setting(
        2, "1", "plans from a guess at most", "tuned: two of four such jumps were good with one"
    )


@dataclass(frozen=True)
class TriedAir:
    """A fit, None for the tables, and how late [s] the plant touched down with its plan."""

    fit: FittedAir | None
    late: float


@dataclass
class Remedies:
    """What has been changed so far, and what is next.

    1. Where only the table misses on the plan's own model, or nearly does, valve edges are put on
       its `ticks`.
    2. Where the plant misses, the air is fitted (`fit`); not where the task says `fit_air: false`,
       or its model has no first-order chambers.
    3. Where it still lands early or late, legs are `pressed` to their stops in flight: vented ones
       stay where friction leaves them, which no fit of the air can tell.
    4. Where a plan does not come true on its own model, or other air fits no better, it is made
       anew `from_guess`: with the fitted air, or where that was tried, from another guess. Not
       without `guess`.
    """

    task: Task
    fit: FittedAir | None = None
    guess: bool = True
    ticks: bool = False
    pressed: bool = False
    from_guess: bool = False
    guesses: int = field(default_factory=lambda: RemedySettings.current().guesses)
    guessed: FittedAir | None = None  # with which a plan was last made from a guess
    seeds: int = 0  # by which the guess differs from the task's
    done: set[str] = field(default_factory=set)
    tried: list[TriedAir] = field(default_factory=list)
    now: str = ""

    def next(self, plan: Executed) -> str:
        """Changes what is asked of the next plan; what to tell, empty where nothing is left."""
        self.from_guess = False
        self.now = self._chosen(plan)
        self.done.add(self.now)
        return WORDS.get(self.now, "")

    def _chosen(self, plan: Executed) -> str:
        if "ticks" not in self.done and (plan.good or table_misses(plan)):
            self.ticks = True
            return "ticks"
        if plan.good:
            return ""
        if comes_true(plan):
            self.tried.append(TriedAir(self.fit, _late(plan)))
            if self._pressable and not between(self.tried):
                self.pressed = True
                self.tried.clear()
                return "press"
            if other := self._other_air(plan):
                self.fit = other
                return "fit"
        worth = self.fit is not None or not comes_true(plan)
        if self.guess and worth and self.guesses and plan.judged and plan.plan.refined:
            self.guesses -= 1
            self.from_guess, self.ticks = True, False
            self.seeds += self.fit is self.guessed
            self.done.discard("ticks")
            self.tried.clear()
            return "anew"
        return ""

    def guess_made(self) -> None:
        """A plan was made from a guess, with the air of now; the next one begins from another."""
        self.guessed = self.fit

    def give_up(self) -> None:
        """The last change found no plan, or one that does not come true: it is taken back."""
        if self.now == "ticks":
            self.ticks = False
        if self.now == "press":
            self.pressed = False

    @property
    def needed(self) -> bool:
        """Whether a plan is made from a guess where the last one cannot be continued."""
        return self.guess and self.now in ("fit", "anew")

    @property
    def asked(self) -> Task:
        """The task with fitted air among its effects, its pulse in flight, or another guess."""
        effects = {name: dict(values) for name, values in self.task.effects.items()}
        for name, values in (self.fit.changes(task_model(self.task)) if self.fit else {}).items():
            effects[name] = {**effects.get(name, {}), **values}
        landing = self.task.landing
        if self.pressed:
            landing = landing.model_copy(update={"air": RemedySettings.current().air})
        start = {}
        if self.from_guess and self.seeds:
            noise = max(self.task.guess_noise, Refining.current().second_start)
            start = {"guess_noise": noise, "seed": self.task.seed + self.seeds}
        return self.task.model_copy(update={"effects": effects, "landing": landing, **start})

    @property
    def remark(self) -> str:
        """What the sentence adds."""
        fitted = f"; {self.fit.sentence}" if self.fit else ""
        pulse = f"; legs are pressed to their stops in flight (landing.air: {_pulse()})"
        return fitted + pulse * self.pressed

    @property
    def _pressable(self) -> bool:
        """Whether a fit was not enough, in a task with a flight and no pulse yet."""
        flies = self.task.height is not None or self.task.feet is not None
        untried = not self.task.landing.air and "press" not in self.done
        return "fit" in self.done and flies and untried

    def _other_air(self, plan: Executed) -> FittedAir | None:
        """Air that may fit better, None where there is none or the last fits were in vain."""
        new = between(self.tried)
        if new is None and not self._in_vain:
            new = _fitted(plan, self.task, self.fit)
        same = new is not None and self.fit is not None and new.factors == self.fit.factors
        return None if same else new

    @property
    def _in_vain(self) -> bool:
        """Whether the last fit has brought the touchdown no nearer than the ones before."""
        *before, last = (abs(tried.late) for tried in self.tried)
        return bool(before) and last > RemedySettings.current().nearer * min(before)


WORDS = {
    "ticks": "valve edges on the ticks of the controller",
    "fit": "the air of the plan's model, fitted to the simulated robot",
    "press": "legs pressed to their stops in flight",
    "anew": "another plan, from a guess",
}


def comes_true(plan: Executed) -> bool:
    """Whether a plan's own inputs come true on its model."""
    return plan.judged is not None and plan.judged.verdicts["replay"].good


def table_misses(plan: Executed) -> bool:
    """Whether of its own model's executions only that of the table misses."""
    return comes_true(plan) and plan.judged is not None and not plan.judged.replays


def between(tried: Sequence[TriedAir]) -> FittedAir | None:
    """Air between the last two figures that were tried, by the secant of their touchdowns; None
    where these are not on both sides of the plan's.

    A fit is made for one motion, and the next plan is another. Of a jump whose feet rise by a
    centimetre, one plan can land 70 ms late and the next one 20 ms early.
    """
    if len(tried) < 2 or tried[-2].late * tried[-1].late >= 0.0:
        return None
    old, new = tried[-2:]
    assert new.fit is not None
    return new.fit.towards(old.fit, new.late / (new.late - old.late))


def _pulse() -> str:
    return f"{1e3 * RemedySettings.current().air:.0f} ms"


def _late(plan: Executed) -> float:
    there = plan.judged.facts["plant_replay"] if plan.judged else None
    return float((there or {}).get("touchdown_error_s") or 0.0)


def _fitted(plan: Executed, task: Task, earlier: FittedAir | None) -> FittedAir | None:
    """The air of the task's model fitted to the plant's motion; None where nothing can be
    fitted."""
    done, table = plan.judged, plan.motions.table
    if not task.fit_air or done is None or done.motion is None or table is None:
        return None
    try:
        return fitted_air(task_model(task), table, done.motion, earlier)
    except KembaError:
        return None
