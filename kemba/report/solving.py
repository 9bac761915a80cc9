"""`solve` as a whole: plan, execute on the fine simulation, draw, write the run folder."""

import shutil
import tempfile
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from kemba.config import Document, dump_yaml
from kemba.files import WriteError, write_json
from kemba.ocp import Plan, Task
from kemba.ocp.continuation.origin import write_stages
from kemba.runs import PLANT_RUN, POLICY, STAGES, RunFolder
from kemba.solve import Approach, best_plan
from kemba.solve.loop import Listener
from kemba.solve.memory import remember
from kemba.solve.trial import Motions
from kemba.trajectory import Trajectory

FIGURE = "figure.png"
DRAWING = "kemba.plotting.motion"  # what draws it; loading it takes about as long as drawing


def draw_plan(plan: Trajectory, folder: Path) -> None:
    """Write the figure of a plan into its run folder. Raises KembaError."""
    from kemba.plotting import draw
    from kemba.plotting.source import PLAN_FILE, Source
    from kemba.plotting.style import save_figure

    source = Source(folder.name, plan, plan=True, path=folder / PLAN_FILE)
    save_figure(draw([source]), folder / FIGURE)


def solve_into(
    folder: RunFolder,
    task: Task,
    document: Document,
    listener: Listener,
    approach: Approach | None = None,
    figure: bool = True,
) -> dict[str, Any]:
    """Solve `task` and fill its run folder; returns the JSON of `solve`.

    `approach`: how the plan is sought. Raises KembaError where the task or a file is wrong; the
    manifest then says `failed`.
    """
    dump_yaml(task.model_dump(exclude_none=True, by_alias=True), folder / "task.yaml")
    approach = replace(approach or Approach(), log=folder / "solver.log")
    try:
        best = best_plan(task, document, approach, listener, str(folder.path))
        found, result = best.plan, best.result
        same = task.model_copy(update={"model": found.task.model})  # a sequence stays one
        kept = same if task.sequence else found.task
        if kept != task:
            dump_yaml(kept.model_dump(exclude_none=True, by_alias=True), folder / "task.yaml")
        if figure:
            listener.tell("drawing")
        _keep(found, result, best.motions, folder, figure)
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
    found: Plan, result: dict[str, Any], motions: Motions, folder: RunFolder, figure: bool
) -> None:
    """Write the run folder; when that fails, write the plan elsewhere and say where."""
    try:
        _write(found, result, motions, folder.path)
        if figure and motions.table is not None:
            draw_plan(found.trajectory, folder.path)
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
    if motions.policy is not None:
        with (folder / POLICY).open("wb") as stream:
            np.savez_compressed(stream, **motions.policy)  # type: ignore[arg-type]
