"""`solve` as a whole: plan, execute on the fine simulation, write the run folder."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kemba.config import Document, dump_yaml
from kemba.errors import KembaError
from kemba.files import WriteError
from kemba.ocp import Plan, Task, controller_table, plan
from kemba.ocp.certificate.status import Status
from kemba.ocp.continuation.between import Origin
from kemba.ocp.nlp.watcher import Watch
from kemba.ocp.report import answer, sentence_of
from kemba.ocp.starts import plan_best
from kemba.plant.execution.certificate import executions, plant_run, summaries
from kemba.plant.execution.counterpart import another_robot, counterpart
from kemba.plant.execution.replay import ends_standing
from kemba.plant.execution.retiming import retimed
from kemba.report.drawing import Drawer, Here
from kemba.report.verdict import verdicts
from kemba.runs import PLANT_RUN, RunFolder, write_json
from kemba.stopwatch import Tell, silent
from kemba.trajectory import Trajectory

if TYPE_CHECKING:
    from kemba.sweep.scenarios.share import Share


@dataclass(frozen=True)
class Listener:
    """What is called at each stage and iteration, and what may ask to stop."""

    tell: Tell = silent
    watch: Watch | None = None
    stop: Callable[[], bool] | None = None


@dataclass(frozen=True)
class Motions:
    """What is written beside the plan: the controller's table, and the motion of the plant."""

    table: Trajectory | None = None
    plant: Trajectory | None = None


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
) -> dict[str, Any]:
    """Solve `task` and fill its run folder; returns the JSON of `solve`.

    `start`: a trajectory to begin from. `starts`, `jobs`: how many start guesses, on how many
    cores. `origin`: an earlier plan to continue for the changed figures. `replay`: execute the
    plan on the same model and on the plant, and compare both with the task's tolerances; a plan
    that misses them is `acceptable`, not `solved`. `drawer`: what draws the figure, this process
    when it is None. Raises KembaError where the task or a file is wrong; the manifest then says
    `failed`.
    """
    dump_yaml(task.model_dump(exclude_none=True), folder / "task.yaml")
    log = folder / "solver.log"
    try:

        def solved(task: Task) -> Plan:
            if starts > 1 and start is None and origin is None:
                return plan_best(task, document, starts, jobs, log, listener.tell)
            how = {"tell": listener.tell, "watch": listener.watch, "stop": listener.stop}
            return plan(task, document, log=log, start=start, origin=origin, **how)  # type: ignore[arg-type]

        found, table, share = _chosen(task, solved, replay, listener)
        if found.task != task:
            dump_yaml(found.task.model_dump(exclude_none=True), folder / "task.yaml")
        result = answer(found, str(folder.path))
        if table is None and found.attempts:
            table = controller_table(found.model, found.trajectory, found.task.hold)
        drawer = drawer or Here()
        if figure and table is not None:
            drawer.begin(found.trajectory, folder.path)
        plant: Trajectory | None = None
        if replay and table is not None and found.status.plan:
            listener.tell("replay: the times of controller.csv")
            if share is None:
                table = retimed(found.model, found.trajectory, table)
            replayed, plant = _replayed(found, table, listener.tell)
            result |= replayed
            if share is not None:
                result |= {"robust": share.summary()}
                result["sentence"] += f"; {share.sentence}"
        drawn = figure and table is not None
        if drawn:
            listener.tell("drawing")
        _keep(found, result, Motions(table, plant), folder, drawer if drawn else None)
    except BaseException:
        with suppress(WriteError):  # the first error says more
            folder.finish("failed")
        raise
    folder.finish(result["status"], sentence=result["sentence"], good=result["good"])
    return result


def _chosen(
    task: Task, solved: Callable[[Task], Plan], replay: bool, listener: Listener
) -> tuple[Plan, Trajectory | None, Share | None]:
    """The plan; where a robust one is asked for, with its table and its share of scenarios."""
    if not replay or task.robust == 0:
        return solved(task), None, None
    from kemba.report.robust import most_robust  # Dask and SciPy take half a second to import

    chosen = most_robust(task, solved, listener.tell)
    return chosen.plan, chosen.table, chosen.share


def _replayed(
    found: Plan, table: Trajectory, tell: Tell
) -> tuple[dict[str, Any], Trajectory | None]:
    """The executions of a plan with the verdict, and the motion of the plant.

    The plan stays solved only if all executions come near enough.
    """
    task = found.task
    try:
        plant = counterpart(task.model, task.payload, task.supply, task.plant, changes=task.effects)
        other = another_robot(task.model, task.plant)
        done = executions(found.model, found.trajectory, table, plant, tell)
    except KembaError as error:  # a model that the simulator cannot execute still has its plan
        return _unconfirmed(found, f"it cannot be simulated: {error}"), None
    executed = summaries(found.model, done)
    there = done["plant_replay"]
    motion = plant_run(there) if there else None
    lands = bool(ends_standing(found.model, found.trajectory))
    names = [f"the plant is another robot, {other}, which {task.plant} names"] if other else []
    judged = verdicts(executed, task.tolerances, lands).values()
    if all(verdict.good for verdict in judged):
        parts = [sentence_of(found), *names, *(verdict.sentence for verdict in judged)]
        return {**executed, "sentence": "; ".join(parts)}, motion
    causes = [verdict.sentence for verdict in judged if not verdict.good]
    matches = [verdict.sentence for verdict in judged if verdict.good]
    return {**executed, **_unconfirmed(found, " and ".join(causes), [*names, *matches])}, motion


def _unconfirmed(found: Plan, cause: str, remarks: Sequence[str] = ()) -> dict[str, Any]:
    """Status and sentence of a plan that its executions do not confirm: it is not solved, even
    where it fulfils its own equations."""
    if found.status is Status.SOLVED:
        what = found.sentence.removeprefix("solved: ")
        parts = [f"FAILED: a plan was found, but {cause}", *remarks, f"the plan: {what}"]
    else:
        parts = [sentence_of(found), cause, *remarks]
    return {"status": Status.ACCEPTABLE, "good": False, "sentence": "; ".join(parts)}


def _keep(
    found: Plan,
    result: dict[str, Any],
    motions: Motions,
    folder: RunFolder,
    drawer: Drawer | None,
) -> None:
    """Write the run folder; when that fails, write the plan elsewhere and say where."""
    try:
        _write(found, result, motions, folder.path)
        if drawer is not None:
            drawer.finish()
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
