"""`kemba.plan`: a task becomes a certified plan in a run folder."""

from __future__ import annotations

import base64
import html
import io
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from textwrap import shorten
from typing import TYPE_CHECKING, Any

from kemba.config import Document, beside, find_config
from kemba.effects import BY_KIND
from kemba.errors import KembaError
from kemba.files import read_json
from kemba.folders import claimed
from kemba.identify.logs.reading import read_log
from kemba.logs import Columns
from kemba.model import Model
from kemba.model import load_model as load
from kemba.model.spec import model_files
from kemba.ocp import Task
from kemba.ocp import load_task as load_with_document
from kemba.plant.repeat import Repeat, outcome, plant_of, repeat_run
from kemba.report.solving import solve_into
from kemba.runs import Run, RunFolder, load_run
from kemba.solve import Approach, Listener
from kemba.stopwatch import Tell, watched
from kemba.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.figure import Figure


ONE_LINE = 160  # characters of a result's repr


class Result(ABC):
    """An answer with a sentence, a verdict and a figure."""

    @property
    @abstractmethod
    def sentence(self) -> str:
        """The answer in words, as the command prints it."""

    @property
    @abstractmethod
    def good(self) -> bool:
        """Whether the command would exit with 0."""

    @abstractmethod
    def figure(self) -> Figure:
        """The answer drawn. Raises KembaError where there is nothing to draw."""

    def __str__(self) -> str:
        return self.sentence

    def __repr__(self) -> str:
        return f"{type(self).__name__}: {shorten(self.sentence, ONE_LINE)}"

    def _repr_html_(self) -> str:
        """Sentence and figure, for notebooks."""
        colour = "#1a7f37" if self.good else "#b42318"
        text = f'<p style="color:{colour}">{html.escape(self.sentence)}</p>'
        buffer = io.BytesIO()
        try:
            self.figure().savefig(buffer, format="png", dpi=100)
        except KembaError:  # nothing to draw
            return text
        data = base64.b64encode(buffer.getvalue()).decode()
        return f'{text}<img alt="{html.escape(self.sentence)}" src="data:image/png;base64,{data}">'


Path_ = str | Path


def load_task(name: Path_, **changes: Any) -> Task:
    """A task; `name`: a path or a shipped name such as `jump.yaml`.

    `changes` are those of `--set`: `height="0.6 m"`; keys with points go in as
    `**{"goals.apex": "0.6 m"}`. Raises KembaError with every mistake at its line.
    """
    return load_with_document(name, settings(changes))[0]


def load_model(name: Path_ = "planning", supply: float | None = None) -> Model:
    """A model; `name`: a path or a shipped name. `supply` in Pa. Raises KembaError."""
    return load(name, supply=supply)


def load_log(path: Path_, columns: Columns = None) -> Trajectory:
    """The log at `path`, of any format of `docs/logs.md`; `columns` is a column map or its file.
    Raises KembaError with row and column of the first fault."""
    return read_log(path, columns)


def settings(changes: dict[str, Any]) -> list[str]:
    """Changes as the `key=value` texts of `--set`."""
    return [f"{key}={value}" for key, value in changes.items()]


@dataclass(frozen=True, repr=False)
class Planned(Result):
    """A run folder and its certificate (the JSON of `solve`)."""

    path: Path
    certificate: dict[str, Any]

    @classmethod
    def read(cls, path: str | Path) -> Planned:
        """The plan of the run at `path`. Raises KembaError where it has no certificate."""
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
    force: bool = False,
    progress: Tell | None = None,
    **changes: Any,
) -> Planned:
    """Plan a motion and certify it, as `kemba-opt solve` does.

    `task`: a path, a shipped name, or a loaded task; `out`: its run folder, `runs/TASK-N` without.
    `model`: instead of the task's. `changes` are those of `--set`: `height` is that of the body's
    centre (at 0.45 m the feet rise 1 cm), `feet` that of the feet. `starts`: guesses to try, the
    best plan is kept. `replay`: execute it in simulation. `cold`: begin from a guess, also where an
    earlier plan of yours is near; `memory`: whether such plans are looked up, and this one listed;
    `force`: replace a finished run in `out`.
    `progress` gets the name of every stage; by default notebooks and terminals show them. Raises
    KembaError for mistakes; a task that cannot be met is none, the certificate says why.
    """
    if isinstance(task, Task):
        resolved, document = task, Document(task.model_dump())
    else:
        resolved, document = load_with_document(task, settings(changes))
    if model is not None:
        resolved = resolved.model_copy(update={"model": beside(str(model), Path())})
    models: list[str | Path] = [*model_files(resolved.model), *model_files(resolved.plant)]
    if not isinstance(task, Task):
        models.insert(0, find_config(task, "tasks"))
    files = [*dict.fromkeys(models), *BY_KIND.files]
    folder = RunFolder.create(out, resolved.name, files, ["kemba.plan"], force)
    approach = Approach(starts=starts, replay=replay, cold=cold, memory=memory)
    listener = Listener(progress or watched())
    answer = solve_into(folder, resolved, document, listener, approach, figure=False)
    return Planned(folder.path, answer)


@dataclass(frozen=True, repr=False)
class Executions(Result):
    """Executions of one run and the logs that were written."""

    run: Path
    plant: str
    repeats: tuple[Repeat, ...]

    @property
    def logs(self) -> list[Path]:
        """The logs, in the log format."""
        return [repeat.path for repeat in self.repeats]

    @property
    def landed(self) -> int:
        """How many ended standing, or upright where the plan does not land."""
        return sum(repeat.replay is not None and repeat.replay.landed for repeat in self.repeats)

    @property
    def good(self) -> bool:
        """Whether all did."""
        return self.landed == len(self.repeats)

    @property
    def sentence(self) -> str:
        """What was reached, in words."""
        return outcome(self.repeats, self.plant)

    def figure(self) -> Figure:
        """Plan and executions on one sheet."""
        from kemba import plotting

        return plotting.draw(plotting.load_sources([self.run, *self.logs]))


def simulate(
    run: Planned | str | Path,
    out: str | Path | None = None,
    *,
    plant: str | None = None,
    repeat: int = 1,
    noise: bool = False,
    seed: int = 0,
    force: bool = False,
    progress: Tell | None = None,
) -> Executions:
    """Execute the controller of `run` on the plant and write logs, as `kemba-opt simulate` does.

    `out`: folder for the logs, a new one in the run without it; `force`: replace logs there.
    `plant`: a model, that of the task without it. `repeat`: how often; `noise` of sensors and
    valves, the same for the same `seed`. `progress`: as of `plan`. Raises KembaError where the run
    has no controller table.
    """
    path = run.path if isinstance(run, Planned) else Path(run)
    default = (path if path.is_dir() else path.parent) / "logs"
    model = plant_of(path, plant)
    with claimed(None if out is None else Path(out), default, "*.csv", force) as folder:
        repeats = repeat_run(path, model, folder, repeat, noise, seed, tell=progress or watched())
    return Executions(path, model.name, tuple(repeats))
