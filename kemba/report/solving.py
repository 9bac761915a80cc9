"""`solve` as a whole: plan, execute on the fine simulation, write the run folder."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kemba.config import Document, dump_yaml
from kemba.errors import KembaError
from kemba.files import WriteError
from kemba.ocp import Plan, Task, controller_table, plan
from kemba.ocp.certificate.status import Status
from kemba.ocp.nlp.watcher import Watch
from kemba.ocp.report import answer
from kemba.ocp.starts import plan_best
from kemba.plant.execution.certificate import replays
from kemba.plant.execution.counterpart import another_robot, counterpart
from kemba.plant.execution.replay import ends_standing
from kemba.report.verdict import verdicts
from kemba.runs import RunFolder, write_json
from kemba.trajectory import Trajectory


@dataclass(frozen=True)
class Listener:
    """Who hears about stages and iterations, and who may ask to stop."""

    tell: Callable[[str], None] = lambda text: None
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
) -> dict[str, Any]:
    """Solve `task` and fill its run folder; returns the JSON of `solve`.

    `start`: a trajectory to go on from; `starts`, `jobs`: several guesses on the cores; `replay`:
    execute the plan on the same model and on the plant, and hold both against the task's
    tolerances: a plan that misses them is `acceptable`, not `solved`. The manifest says `failed`
    when this raises.
    """
    dump_yaml(task.model_dump(exclude_none=True), folder / "task.yaml")
    log = folder / "solver.log"
    try:
        if starts > 1 and start is None:
            found = plan_best(task, document, starts, jobs, log, listener.tell)
        else:
            how = {"tell": listener.tell, "watch": listener.watch, "stop": listener.stop}
            found = plan(task, document, log=log, start=start, **how)  # type: ignore[arg-type]
        result = answer(found, str(folder.path))
        if replay and found.status.plan:
            listener.tell("replay")
            result |= _replayed(found)
        _keep(found, result, folder, figure)
    except BaseException:
        with suppress(WriteError):  # the first error tells more
            folder.finish("failed")
        raise
    folder.finish(result["status"], sentence=result["sentence"], good=result["good"])
    return result


def _replayed(found: Plan) -> dict[str, Any]:
    """The executions of a plan, and the verdict: it stays solved only if both come near enough."""
    task = found.task
    table = controller_table(found.model, found.trajectory)
    try:
        plant = counterpart(task.model, task.payload, task.supply, task.plant)
        other = another_robot(task.model, task.plant)
        executed = replays(found.model, found.trajectory, table, plant)
    except KembaError as error:  # a model that the simulator cannot execute still has its plan
        return _unconfirmed(found, [f"but there is no replay: {error}"])
    lands = bool(ends_standing(found.model, found.trajectory))
    said = [f"the plant is another robot, {other}, which {task.plant} names"] if other else []
    told = verdicts(executed, task.tolerances, lands).values()
    sentences = [*said, *(verdict.sentence for verdict in told)]
    if all(verdict.good for verdict in told):
        return {**executed, "sentence": "; ".join([found.sentence, *sentences])}
    return {**executed, **_unconfirmed(found, sentences)}


def _unconfirmed(found: Plan, sentences: list[str]) -> dict[str, Any]:
    """Status and sentence of a plan whose executions do not keep what it promises: it is not
    solved, however well it fulfils its own equations."""
    solved = found.status is Status.SOLVED
    plan = f"{Status.ACCEPTABLE}, the plan is {found.sentence}" if solved else found.sentence
    return {
        "status": Status.ACCEPTABLE,
        "good": False,
        "sentence": "; ".join([plan, *sentences]),
    }


def _keep(found: Plan, result: dict[str, Any], folder: RunFolder, figure: bool) -> None:
    """Write the run folder; when that fails, write the plan elsewhere and say where."""
    try:
        _write(found, result, folder.path, figure)
    except WriteError as error:
        elsewhere = Path(tempfile.mkdtemp(prefix="kemba-kept-"))
        try:
            _write(found, result, elsewhere, figure=False)
        except WriteError:
            shutil.rmtree(elsewhere, ignore_errors=True)
            raise error from None
        hint = f"the plan is kept in {elsewhere}; {error.hint}"
        raise type(error)(error.where, error.what, hint=hint) from None


def _write(found: Plan, result: dict[str, Any], folder: Path, figure: bool) -> None:
    write_json(folder / "certificate.json", result)
    if not found.attempts:
        return  # refused before solving: there is no motion to write
    found.trajectory.write(folder / "trajectory.csv")
    controller_table(found.model, found.trajectory).write(folder / "controller.csv")
    if figure:
        from kemba import plotting

        sources = plotting.load_sources([folder])
        plotting.save_figure(plotting.draw(sources), folder / "figure.png")
