"""Progress of long work on stderr: what is being done, and about how much time is left."""

from __future__ import annotations

import time
from typing import Any

from kemba.stopwatch import Stage
from kemba_cli.common import loud, say, talk
from kemba_cli.course import Course, Left

EVERY = 10  # iterations between the lines of -v
PAUSE = 2.0  # s between lines of stages that are alike, where no one watches


class Progress:
    """Shows stages and iterations: live on a terminal, one line a stage elsewhere.

    `course`: how far the work is when a stage begins. `limit`: seconds that it takes at most.
    """

    def __init__(self, quiet: bool, course: Course, limit: float | None = None) -> None:
        self.quiet, self.live = quiet, not quiet and talk().is_terminal
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

    def watch(self, iteration: int, objective: float, violation: float) -> None:
        """An iteration of the current stage."""
        if self.live and iteration % 5 == 0:
            numbers = f"iteration {iteration}, violation {violation:.0e}"
            self.bar.update(self.task, description=f"{self.stage}: {numbers}")
        elif loud.get() and iteration % EVERY == 0:
            numbers = f"objective {objective:.3g}, violation {violation:.1e}"
            say(f"          iteration {iteration}, {numbers}", self.quiet)

    def _line(self, stage: str) -> None:
        """One line for a stage; of stages that are alike not all."""
        alike, now = stage.name if isinstance(stage, Stage) else stage, time.monotonic()
        if alike == self.alike and now < self.told + PAUSE and stage != alike:
            return
        self.alike, self.told = alike, now
        left = f", {self.left.words}" if self.left.words else ""
        say(f"{now - self.started:6.1f} s  {stage}{left}", self.quiet)


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
