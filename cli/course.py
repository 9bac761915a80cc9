"""How far long work is: which share of its time is over when a stage begins, and what is left.

The shares were measured on the shipped jump and on three logs of it. They are for an estimate of
the time left, which says "about"; nothing is decided by them.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass

from kemba.stopwatch import Stage

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
    until: float = 0.0  # share at the end of this stage

    def __post_init__(self) -> None:
        self.began = self.entered = time.monotonic()

    def enter(self, stage: str) -> None:
        """A stage begins. One that usually comes earlier does not undo what was reached."""
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
        if seconds is None:
            return ""
        return f"{'about' if self.known else 'at most'} {duration(seconds)} left"


def duration(seconds: float) -> str:
    """Seconds as one says them: 8 s, 50 s, 3 min."""
    if seconds < 10.0:
        return f"{max(1, round(seconds))} s"
    return f"{5 * round(seconds / 5)} s" if seconds < 90.0 else f"{round(seconds / 60)} min"
