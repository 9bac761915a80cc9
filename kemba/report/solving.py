"""`solve` as a whole: plan, execute on the fine simulation, write the run folder.

Loading matplotlib and drawing take about as long as the executions; on two cores they go on at the
same time.
"""

import os
import shutil
import signal
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from kemba.config import Document, dump_yaml
from kemba.effects import BY_KIND, load_effects
from kemba.errors import KembaError
from kemba.files import WriteError, write_json
from kemba.ocp import Plan, Task
from kemba.ocp.continuation.origin import write_stages
from kemba.runs import PLANT_RUN, STAGES, RunFolder
from kemba.solve import Approach, best_plan
from kemba.solve.listener import Listener
from kemba.solve.memory import remember
from kemba.solve.trial import Motions
from kemba.trajectory import Trajectory

FIGURE = "figure.png"
Order = tuple[Trajectory, Path]  # a plan, and its run folder


class Here:
    """Draws the figure of a plan, in this process, when it is asked for."""

    order: Order | None = None

    def begin(self, plan: Trajectory, folder: Path) -> None:
        """A plan is known; its figure is for `folder`, which has a `task.yaml`. The last one of
        several stays."""
        self.order = plan, folder

    def finish(self) -> None:
        """Return when the figure is written. Raises KembaError where it cannot be."""
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
        """See `Here`."""
        super().begin(plan, folder)
        self.begun += 1
        with suppress(OSError):  # it is dead: `finish` notices
            self.pipe.send(self.order)

    def finish(self) -> None:
        """See `Here`."""
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
def drawer(wanted: bool) -> Iterator[Here]:
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
    from kemba.plotting import draw
    from kemba.plotting.source import PLAN_FILE, Source
    from kemba.plotting.style import save_figure

    source = Source(folder.name, plan, plan=True, path=folder / PLAN_FILE)
    save_figure(draw([source]), folder / FIGURE)


def _serve(pipe: Connection, effects: dict[str, str]) -> None:
    """Draw the plans that come; answer each with None or the error."""
    import kemba.plotting.motion  # noqa: F401  now, while there is time

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


def solve_into(
    folder: RunFolder,
    task: Task,
    document: Document,
    listener: Listener,
    approach: Approach | None = None,
    figure: bool = True,
    drawer: Here | None = None,
) -> dict[str, Any]:
    """Solve `task` and fill its run folder; returns the JSON of `solve`.

    `approach`: how the plan is sought. `drawer`: what draws the figure, this process when None.
    Raises KembaError where the task or a file is wrong; the manifest then says `failed`.
    """
    dump_yaml(task.model_dump(exclude_none=True, by_alias=True), folder / "task.yaml")
    approach = replace(approach or Approach(), log=folder / "solver.log")
    drawing = (drawer or Here()) if figure else None

    def begun(plan: Trajectory) -> None:
        if drawing is not None:
            drawing.begin(plan, folder.path)

    try:
        best = best_plan(task, document, approach, listener, begun, str(folder.path))
        found, result = best.plan, best.result
        if found.task != task and not task.sequence:
            dump_yaml(found.task.model_dump(exclude_none=True, by_alias=True), folder / "task.yaml")
        if figure:
            listener.tell("drawing")
        _keep(found, result, best.motions, folder, drawing)
    except BaseException:
        with suppress(WriteError):  # the first error says more
            folder.finish("failed")
        raise
    if approach.memory and result["good"]:
        remember(found, folder.path)
    facts = {key: result[key] for key in ("sentence", "good", "start")}
    folder.finish(result["status"], **facts)
    return result


def _keep(
    found: Plan, result: dict[str, Any], motions: Motions, folder: RunFolder, drawing: Here | None
) -> None:
    """Write the run folder; when that fails, write the plan elsewhere and say where."""
    try:
        _write(found, result, motions, folder.path)
        if drawing is not None:
            drawing.finish()
    except WriteError as error:
        elsewhere = Path(tempfile.mkdtemp(prefix="kemba-kept-"))
        try:
            _write(found, result, motions, elsewhere)
        except WriteError:
            shutil.rmtree(elsewhere, ignore_errors=True)
            raise error from None
        hint = f"the plan is kept in {elsewhere}; {error.hint}"
        raise type(error)(error.where, error.what, hint=hint) from None


def _write(found: Plan, result: dict[str, Any], motions: Motions, folder: Path) -> None:
    write_json(folder / "certificate.json", result)
    if motions.table is None:
        return  # refused before solving: there is no motion to write
    found.trajectory.write(folder / "trajectory.csv")
    motions.table.write(folder / "controller.csv")
    if found.stages is not None:
        write_stages(folder / STAGES, found.stages)
    if motions.plant is not None:
        motions.plant.write(folder / PLANT_RUN)
