"""`kemba.plan`: a task becomes a certified plan in a run folder."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kemba.api.loading import settings
from kemba.api.result import Result
from kemba.config import Document, beside, find_config
from kemba.effects import BY_KIND
from kemba.files import read_json
from kemba.model.spec import model_files
from kemba.ocp import Task, load_task
from kemba.report import solve_into
from kemba.runs import Run, RunFolder, load_run
from kemba.solve import Approach, Listener
from kemba.stopwatch import Tell, silent
from kemba.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Planned(Result):
    """A run folder and its certificate (the JSON of `solve`)."""

    path: Path
    certificate: dict[str, Any]

    @classmethod
    def read(cls, path: str | Path) -> Planned:
        """The plan of an earlier run. Raises KembaError where it has no certificate."""
        return cls(Path(path), read_json(Path(path) / "certificate.json"))

    @property
    def sentence(self) -> str:
        """The verdict in words."""
        return str(self.certificate["sentence"])

    @property
    def good(self) -> bool:
        """Whether it is solved and its executions agree with it."""
        return bool(self.certificate.get("good"))

    @cached_property
    def run(self) -> Run:
        """The files of the folder."""
        return load_run(self.path)

    @property
    def trajectory(self) -> Trajectory:
        """The plan at its nodes."""
        return self.run.trajectory

    @property
    def controller(self) -> Trajectory:
        """The table that the robot plays, 1 kHz."""
        return self.run.controller

    def figure(self) -> Figure:
        """Body, joints, efforts, valves, contacts. Raises KembaError where there is no plan."""
        from kemba import plotting

        return plotting.draw(plotting.load_sources([self.path]))


def plan(
    task: str | Path | Task,
    out: str | Path | None = None,
    *,
    model: str | Path | None = None,
    starts: int = 1,
    replay: bool = True,
    cold: bool = False,
    memory: bool = True,
    progress: Tell = silent,
    **changes: Any,
) -> Planned:
    """Plan a motion and certify it, as `kemba-opt solve` does.

    `task`: a path, a shipped name, or a loaded task; `out`: its run folder, `runs/TASK-N` without.
    `changes` are those of `--set`: `height` is that of the body's centre (at 0.45 m the feet rise
    1 cm), `feet` that of the feet. `cold`: begin from a guess, also where an
    earlier plan of yours is near; `memory`: whether such plans are looked up, and this one listed.
    `progress` gets the name of every stage. Raises KembaError for
    mistakes; a task that cannot be met is no mistake, the certificate says why.
    """
    if isinstance(task, Task):
        resolved, document = task, Document(task.model_dump())
    else:
        resolved, document = load_task(task, settings(changes))
    if model is not None:
        resolved = resolved.model_copy(update={"model": beside(str(model), Path())})
    models: list[str | Path] = [*model_files(resolved.model), *model_files(resolved.plant)]
    if not isinstance(task, Task):
        models.insert(0, find_config(task, "tasks"))
    files = [*dict.fromkeys(models), *BY_KIND.files]
    folder = RunFolder.create(out, resolved.name, files, ["kemba.plan"])
    answer = solve_into(
        folder,
        resolved,
        document,
        Listener(progress),
        Approach(starts=starts, replay=replay, cold=cold, memory=memory),
        figure=False,
    )
    return Planned(folder.path, answer)
