"""The figure of a plan, drawn by a second process while the plan is executed.

Loading matplotlib and drawing take about as long as the executions; on two cores they go on at the
same time.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Protocol

from kemba.effects import BY_KIND, load_effects
from kemba.errors import KembaError
from kemba.trajectory import Trajectory

FIGURE = "figure.png"
Order = tuple[Trajectory, Path]  # a plan, and its run folder


class Drawer(Protocol):
    """What draws the figure of a plan."""

    def begin(self, plan: Trajectory, folder: Path) -> None:
        """A plan is known; its figure is for `folder`, which has a `task.yaml`. The last one of
        several stays."""

    def finish(self) -> None:
        """Return when the figure is written. Raises KembaError where it cannot be."""


class Nowhere:
    """Draws nothing."""

    def begin(self, plan: Trajectory, folder: Path) -> None:
        """See `Drawer`."""

    def finish(self) -> None:
        """See `Drawer`."""


class Here:
    """Draws in this process, when the figure is asked for."""

    order: Order | None = None

    def begin(self, plan: Trajectory, folder: Path) -> None:
        """See `Drawer`."""
        self.order = plan, folder

    def finish(self) -> None:
        """See `Drawer`. Raises KembaError where the figure cannot be written."""
        if self.order is not None:
            draw_plan(*self.order)


class Beside(Here):
    """Draws in a process of its own, which loads matplotlib while the plan is still sought."""

    def __init__(self) -> None:
        self.begun = 0
        context = get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs, BY_KIND.files), daemon=True)
        before = signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is answered by us alone
        try:
            self.process.start()
        finally:
            signal.signal(signal.SIGINT, before)
        theirs.close()

    def begin(self, plan: Trajectory, folder: Path) -> None:
        """See `Drawer`."""
        super().begin(plan, folder)
        self.begun += 1
        with suppress(OSError):  # it is dead: `finish` notices
            self.pipe.send(self.order)

    def finish(self) -> None:
        """See `Drawer`. Raises KembaError where the figure cannot be written."""
        error: KembaError | None = None
        try:
            for _ in range(self.begun):
                error = self.pipe.recv()
        except (EOFError, OSError):
            super().finish()  # it died, as it may where memory is short
            return
        if error is not None:
            raise error

    def close(self) -> None:
        """End the process."""
        self.pipe.close()
        self.process.terminate()
        self.process.join()


@contextmanager
def drawer(wanted: bool) -> Iterator[Drawer]:
    """What draws the figure of a command: a second process where there is a core for it.

    In a process that has loaded matplotlib already, drawing there costs less.
    """
    alone = (os.cpu_count() or 1) < 2 or "matplotlib" in sys.modules
    if not wanted or alone:
        yield Here()
        return
    process = Beside()
    try:
        yield process
    finally:
        process.close()


def draw_plan(plan: Trajectory, folder: Path) -> None:
    """Write the figure of a plan into its run folder. Raises KembaError."""
    from kemba.plotting import draw, save_figure
    from kemba.plotting.source import PLAN_FILE, Source

    source = Source(folder.name, plan, plan=True, path=folder / PLAN_FILE)
    save_figure(draw([source]), folder / FIGURE)


def _serve(pipe: Connection, effects: dict[str, str]) -> None:
    """Draw the plans that come; answer each with None or the error."""
    import kemba.plotting.choice  # noqa: F401  now, while there is time

    load_effects(effects)
    with suppress(EOFError, OSError):  # no more plans, or nobody waits any more
        while True:
            order = pipe.recv()
            error: KembaError | None = None
            try:
                draw_plan(*order)
            except KembaError as found:
                error = found
            except Exception:  # the first process tries once more, and tells what is wrong
                return
            pipe.send(error)
