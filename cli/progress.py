"""Progress of long work on stderr, when someone is watching."""

from __future__ import annotations

import time
from typing import Any

from kemba_cli.common import loud, say, talk

EVERY = 10  # iterations between the lines of -v


class Progress:
    """Shows stages and iterations: live on a terminal, one line a stage elsewhere."""

    def __init__(self, quiet: bool) -> None:
        self.quiet, self.live = quiet, not quiet and talk().is_terminal
        self.started = time.monotonic()
        self.stage = ""
        self.status: Any = None

    def __enter__(self) -> Progress:
        if self.live:
            self.status = talk().status("building")
            self.status.start()
        return self

    def __exit__(self, *error: object) -> None:
        if self.status is not None:
            self.status.stop()

    def tell(self, stage: str) -> None:
        """A new stage begins."""
        self.stage = stage
        seconds = time.monotonic() - self.started
        if self.live:
            self.status.update(stage)
        else:
            say(f"{seconds:6.1f} s  {stage}", self.quiet)

    def watch(self, iteration: int, objective: float, violation: float) -> None:
        """An iteration of the current stage."""
        if self.live and iteration % 5 == 0:
            seconds = time.monotonic() - self.started
            self.status.update(
                f"{self.stage}: iteration {iteration}, objective {objective:.3g}, "
                f"violation {violation:.1e}, {seconds:.0f} s"
            )
        elif loud.get() and iteration % EVERY == 0:
            numbers = f"objective {objective:.3g}, violation {violation:.1e}"
            say(f"          iteration {iteration}, {numbers}", self.quiet)
