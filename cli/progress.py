"""Progress of long work on stderr: what is being done, and about how much time is left.

The shares were measured on the shipped jump and on three logs of it. They are for an estimate of
the time left, which says "about"; nothing is decided by them.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from kemba.stopwatch import Stage
from kemba_cli.common import manner, say, talk

EARLY = 0.08  # share of the work before which nothing can be said of the rest
SOON = 1.0  # s, before which nothing can be said either

Course = Mapping[str, float]  # first words of a stage -> share of the time before it

SOLVE: Course = {
    "relax": 0.1,
    "binary valves": 0.17,
    "round valves": 0.18,
    "move switches": 0.23,
    "fix valves": 0.31,
    "tighten": 0.39,
    "confirm": 0.42,
    "phases": 0.47,
    "replay: the times": 0.82,
    "replay": 0.88,
    "drawing": 0.92,
}
NEAR: Course = {  # solved from another plan
    "from the": 0.1,
    "replay: the times": 0.45,
    "replay": 0.75,
    "drawing": 0.85,
}
ROBUST: Course = {"replay": 0.95, "drawing": 0.98}  # after plans whose number nobody knows
COMPARE: Course = {
    "reading": 0.0,
    "finding the motion": 0.01,
    "learning the noise": 0.24,
    "comparing": 0.66,
}
DISCOVER: Course = {
    "reading": 0.0,
    "finding the motion": 0.01,
    "fitting the model": 0.06,
    "refitting": 0.42,
    "searching again": 0.55,
    "simulating logs": 0.95,
    "testing whether": 0.96,
    "ranking": 0.98,
}


def within(course: Course, first: float, last: float) -> dict[str, float]:
    """A course as a part of longer work, from the share `first` to the share `last` of it."""
    return {name: first + share * (last - first) for name, share in course.items()}


LEARN: Course = {
    **within({k: v for k, v in COMPARE.items() if k not in DISCOVER}, 0.02, 0.1),
    **within(DISCOVER, 0.1, 0.7),
    "comparing with what was learnt": 0.7,
    **within(SOLVE, 0.75, 0.95),
    "correction": 0.95,
}
REVIEW: Course = {**within(COMPARE, 0.0, 0.9), "drawing": 0.9}
SIMULATE: Course = {"executing": 0.0}
SWEEP: Course = {"case": 0.0}
EXPERIMENT: Course = {"judging the standard": 0.0, "fitting the rivals": 0.8, "planning": 0.8}
SENSITIVITY: Course = {"the same commands": 0.02, "the plan made anew": 0.35}


def span(course: Course, stage: str) -> tuple[float, float]:
    """The share of the time [0, 1] before and after a stage; that of all before an unknown one."""
    known = [name for name in course if stage.startswith(name)]
    if not known:
        return 0.0, 0.0
    begins = course[max(known, key=len)]
    ends = min((share for share in course.values() if share > begins), default=1.0)
    if isinstance(stage, Stage):
        length = (ends - begins) / stage.parts
        return begins + (stage.part - 1) * length, begins + stage.part * length
    return begins, ends


@dataclass
class Left:
    """The time left of work on a `course`; `limit`: seconds that it takes at most."""

    course: Course
    limit: float | None = None
    share: float = 0.0  # of the work that is done
    once: bool = False  # a stage of unknown length, the first time on a machine
    until: float = 0.0  # share at the end of this stage

    def __post_init__(self) -> None:
        self.began = self.entered = time.monotonic()

    def enter(self, stage: str) -> None:
        """A stage begins. One that usually comes earlier does not undo what was reached."""
        self.once = stage.startswith("compiling")
        if self.course is SOLVE and stage.startswith("from the"):
            self.course = NEAR
        elif self.course is NEAR and stage.startswith("relax"):  # that failed: from a guess
            self.course, self.share, self.began = SOLVE, 0.0, time.monotonic()
        elif "scenarios succeed" in stage:
            self.course, self.share = ROBUST, 0.0
        begins, ends = span(self.course, stage)
        if begins >= self.share and ends > begins:
            self.share, self.until, self.entered = begins, ends, time.monotonic()

    @property
    def known(self) -> bool:
        """Whether more than the limit is known."""
        return self.share >= EARLY and self.entered - self.began >= SOON

    @property
    def seconds(self) -> float | None:
        """About how many seconds are left; None while nothing can be said."""
        now = time.monotonic()
        found = None
        if self.known:
            whole = (self.entered - self.began) / self.share
            least = (1.0 - self.until) * whole  # what follows this stage
            found = max(whole - (now - self.began), least)
        if self.limit is None:
            return found
        most = max(self.limit - (now - self.began), 0.0)
        return most if found is None else min(found, most)

    @property
    def words(self) -> str:
        """The time left in words; empty while nothing can be said."""
        seconds = self.seconds
        if seconds is None or self.once:
            return ""
        return f"{'about' if self.known else 'at most'} {duration(seconds)} left"


def duration(seconds: float) -> str:
    """Seconds as one says them: 8 s, 50 s, 3 min."""
    if seconds < 10.0:
        return f"{max(1, round(seconds))} s"
    return f"{5 * round(seconds / 5)} s" if seconds < 90.0 else f"{round(seconds / 60)} min"


EVERY = 10  # iterations between the lines of -v
PAUSE = 2.0  # s between lines of stages that are alike, where no one watches


class Progress:
    """Shows stages and iterations: live on a terminal, one line a stage elsewhere.

    `course`: how far the work is when a stage begins. `limit`: seconds that it takes at most.
    """

    def __init__(self, course: Course, limit: float | None = None) -> None:
        self.live = not manner.get().silent and talk().is_terminal
        self.started = time.monotonic()
        self.left = Left(course, limit)
        self.stage = self.alike = ""
        self.told = 0.0
        self.bar: Any = None

    def __enter__(self) -> Progress:
        if self.live:
            self.bar = bar(self.left)
            self.bar.start()
            self.task = self.bar.add_task("preparing", total=1.0)
        return self

    def __exit__(self, *error: object) -> None:
        if self.bar is not None:
            self.bar.stop()

    def tell(self, stage: str) -> None:
        """A new stage begins."""
        self.stage = stage
        self.left.enter(stage)
        if self.live:
            self.bar.update(self.task, description=stage, completed=self.left.share)
        else:
            self._line(stage)

    def remark(self, text: str) -> None:
        """A line that stays, above the bar where there is one."""
        if self.live:
            self.bar.console.print(text, markup=False)
        else:
            say(text)

    def watch(self, iteration: int, objective: float, violation: float) -> None:
        """An iteration of the current stage."""
        if self.live and iteration % 5 == 0:
            numbers = f"iteration {iteration}, violation {violation:.0e}"
            self.bar.update(self.task, description=f"{self.stage}: {numbers}")
        elif manner.get().verbose and iteration % EVERY == 0:
            numbers = f"objective {objective:.3g}, violation {violation:.1e}"
            say(f"          iteration {iteration}, {numbers}")

    def _line(self, stage: str) -> None:
        """One line for a stage; of stages that are alike not all."""
        alike, now = stage.name if isinstance(stage, Stage) else stage, time.monotonic()
        if alike == self.alike and now < self.told + PAUSE and stage != alike:
            return
        self.alike, self.told = alike, now
        left = f", {self.left.words}" if self.left.words else ""
        say(f"{now - self.started:6.1f} s  {stage}{left}")


def bar(left: Left) -> Any:
    """A bar with the stage, the time since the start and the time left."""
    from rich.progress import (
        BarColumn,
        ProgressColumn,
        SpinnerColumn,
        TextColumn,
        TimeElapsedColumn,
    )
    from rich.progress import Progress as Bar
    from rich.text import Text

    class Remaining(ProgressColumn):
        def render(self, task: Any) -> Text:
            return Text(left.words)

    stage = TextColumn("{task.description}", markup=False)
    columns = (SpinnerColumn(), stage, BarColumn(20), TimeElapsedColumn(), Remaining())
    return Bar(*columns, console=talk(), transient=True)
