"""`solve` as a whole: plan, execute on the fine simulation, write the run folder."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kemba.config import Document, dump_yaml
from kemba.files import WriteError
from kemba.ocp import Plan, Task, plan
from kemba.ocp.continuation.between import Origin
from kemba.ocp.known import compared
from kemba.ocp.nlp.watcher import Watch
from kemba.ocp.planning import plans_nearby
from kemba.ocp.starts import plan_best
from kemba.report.drawing import Drawer, Here, Nowhere
from kemba.report.executed import Motions, executed
from kemba.runs import PLANT_RUN, RunFolder, write_json
from kemba.stopwatch import Tell, silent
from kemba.trajectory import Trajectory

if TYPE_CHECKING:
    from kemba.report.executed import Candidate


@dataclass(frozen=True)
class Listener:
    """What is called at each stage and iteration, and what may ask to stop."""

    tell: Tell = silent
    watch: Watch | None = None
    stop: Callable[[], bool] | None = None


def solve_into(
    folder: RunFolder,
    task: Task,
    document: Document,
    listener: Listener,
    start: Trajectory | None = None,
    starts: int = 1,
    jobs: int | None = None,
    replay: bool = True,
    figure: bool = True,
    origin: Origin | None = None,
    drawer: Drawer | None = None,
    cold: bool = False,
) -> dict[str, Any]:
    """Solve `task` and fill its run folder; returns the JSON of `solve`.

    `start`: a trajectory to begin from. `starts`, `jobs`: how many start guesses, on how many
    cores. `origin`: an earlier plan to continue for the changed figures. Where none of these is
    given, shipped plans that are near come first, unless `cold`. `replay`: execute the plan on the
    same model and on the plant, and compare both with the task's tolerances; a plan that misses
    them is `acceptable`, not `solved`. `drawer`: what draws the figure, this process when it is
    None. Raises KembaError where the task or a file is wrong; the manifest then says `failed`.
    """
    dump_yaml(task.model_dump(exclude_none=True), folder / "task.yaml")
    log = folder / "solver.log"
    how = {"tell": listener.tell, "watch": listener.watch, "stop": listener.stop}
    shelved = not cold and start is None and origin is None

    def nearby(task: Task) -> Iterator[Plan]:
        return plans_nearby(task, document, log, **how) if shelved else iter(())  # type: ignore[arg-type]

    def solved(task: Task) -> Plan:
        if starts > 1 and start is None and origin is None:
            return plan_best(task, document, starts, jobs, log, listener.tell)
        return plan(task, document, log=log, start=start, origin=origin, **how)  # type: ignore[arg-type]

    def candidates() -> Iterator[Candidate]:
        if replay and task.robust > 0:
            from kemba.report.robust import most_robust  # Dask and SciPy load for half a second

            found = most_robust(
                task, lambda task: next(nearby(task), None) or solved(task), listener.tell
            )
            yield found.plan, found.table, found.share
            return
        yield from ((near, None, None) for near in nearby(task))
        yield solved(task), None, None

    drawing = (drawer or Here()) if figure else Nowhere()
    try:
        made = (executed(*one, replay, listener.tell, folder, drawing) for one in candidates())
        best = last = next(made)
        while starts > 1 or not best.good:
            other = next(made, None)
            if other is None:
                break
            best, last = max(best, other, key=lambda made: made.rank), other
        if best is not last and best.motions.table is not None:
            drawing.begin(best.plan.trajectory, folder.path)
        found, result = best.plan, best.result
        if found.task != task:
            dump_yaml(found.task.model_dump(exclude_none=True), folder / "task.yaml")
        known, remark = compared(found)
        result |= {"best_known": known, "sentence": result["sentence"] + remark}
        if figure:
            listener.tell("drawing")
        _keep(found, result, best.motions, folder, drawing)
    except BaseException:
        with suppress(WriteError):  # the first error says more
            folder.finish("failed")
        raise
    facts = {key: result[key] for key in ("sentence", "good", "start")}
    folder.finish(result["status"], **facts)
    return result


def _keep(
    found: Plan, result: dict[str, Any], motions: Motions, folder: RunFolder, drawing: Drawer
) -> None:
    """Write the run folder; when that fails, write the plan elsewhere and say where."""
    try:
        _write(found, result, motions, folder.path)
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
    if motions.plant is not None:
        motions.plant.write(folder / PLANT_RUN)
