"""The plans that are shipped, and which of them are near a task."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from kemba.config import load_yaml, shipped_folder
from kemba.model import Model
from kemba.ocp.reading import task_model
from kemba.ocp.shipped.entry import Entry
from kemba.ocp.shipped.kind import FIGURES, as_asked_by, figures_of, kind_of
from kemba.ocp.task.task import Task, parse_task
from kemba.settings import Settings, setting

TRIED = "tuned: continuation of jump and jump_forward (docs/continuing.md)"
INDEX = "plans.csv"
MODEL = {"model", "effects"}  # what names the model of a task


class Near(Settings):
    """How far a plan may be from a task, figure by figure, so that the task begins from it."""

    height: float = setting(0.06, "m", "of the body's centre", TRIED)
    distance: float = setting(0.1, "m", "forward", TRIED)
    supply: float = setting(0.1e6, "Pa", "supply pressure", TRIED)
    payload: float = setting(0.5, "kg", "at the body's centre", TRIED)
    duration: float = setting(0.15, "s", "nominal", TRIED)
    tried: int = setting(3, "1", "shipped plans from which a task is begun, at most",
                         "convention: a plan from a guess costs about as much")  # fmt: skip

    dear: float = setting(
        1.5, "1", "times the cost of the plans nearby beyond which the user is told",
        "convention: neighbours on the shelf differ by less",
    )  # fmt: skip

    def differences(self, asked: Mapping[str, float], there: Mapping[str, float]) -> np.ndarray:
        """Differences of two tasks' figures, in units of these settings; infinite where one task
        lacks a figure of the other."""
        if asked.keys() != there.keys():
            return np.array([np.inf])
        return np.array([abs(asked[n] - there[n]) / float(getattr(self, n)) for n in asked])


@dataclass(frozen=True)
class Neighbour:
    """A plan near a task, and its differences from it, in units of `Near`.

    `task`: what was asked of the plan, and its model, but for its figures and fitted air.
    """

    entry: Entry
    differences: np.ndarray
    task: Task

    @property
    def away(self) -> float:
        """The largest difference."""
        return float(self.differences.max(initial=0.0))

    @property
    def apart(self) -> float:
        """All differences: the root of the sum of their squares."""
        return float(np.linalg.norm(self.differences))

    def asked(self) -> Task:
        """What was asked of the plan, and its model."""
        effects = {**self.task.effects, **self.entry.effects}
        return self.task.model_copy(update={**self.entry.figures, "feet": None, "effects": effects})


def neighbours(task: Task, model: Model, folder: Path | None = None) -> list[Neighbour]:
    """The shipped plans near a task, the nearest first; none for another robot or kind of task.

    Of those with the same figures the cheapest comes first; for a `robust` task the one that lands
    most often. A task that asks for its own start (`guess_noise`, `seed`), another method or no
    refinement has none. `folder`: where other plans are.
    """
    if not _may_begin(task):
        return []
    kept = shelf(folder or shipped_folder("plans"))
    kind = kind_of(task, model) if kept else ""
    asked, near = figures_of(task, model), Near.current()
    found = (Neighbour(e, near.differences(asked, e.figures), task) for e in kept if e.kind == kind)
    close = (n for n in found if n.away <= 1.0)

    def order(n: Neighbour) -> tuple[float, float]:
        return n.apart, -n.entry.landed if task.robust else n.entry.cost

    return sorted(close, key=order)


def relatives(task: Task, model: Model) -> list[Neighbour]:
    """The plans near a task that no shipped one is like: those of the shipped task with the nearest
    plans. First of tasks with the same model, which ask something else, as another pose at the
    start or another bound; then of tasks with a shipped model of the same robot."""
    if not _may_begin(task):
        return []
    alike = [(as_asked_by(shipped, task), shipped) for shipped in _shipped_tasks()]
    near = _nearest((own, model) for own, _ in alike)
    if near:
        return near
    others = [own.model_copy(update=shipped.model_dump(include=MODEL)) for own, shipped in alike]
    models = ((own, task_model(own)) for own in others)
    robot = model.mechanism.robot
    return _nearest((own, m) for own, m in models if m.mechanism.robot == robot)


def _nearest(tasks: Iterable[tuple[Task, Model]]) -> list[Neighbour]:
    found = (neighbours(task, model) for task, model in tasks)
    return min((near for near in found if near), key=lambda near: near[0].apart, default=[])


def _may_begin(task: Task) -> bool:
    """Whether a task may begin from a shipped plan: it asks for no start or method of its own."""
    own = task.method == "relaxation" and task.refine == "radau"
    own = own and not (task.contacts or task.periodic or task.sequence)
    return own and not task.guess_noise and not task.seed and task.guess == "automatic"


def ways(near: Sequence[Neighbour]) -> Iterator[Neighbour]:
    """The nearest neighbour of each order of valves and contacts and each fitted air: from another
    of the same a task mostly ends in the same plan."""
    met = set()
    for neighbour in near:
        way = neighbour.entry.way
        if way not in met:
            yield neighbour
        met.add(way)


@cache
def _shipped_tasks() -> Sequence[Task]:
    files = sorted(shipped_folder("tasks").glob("*.yaml"))
    return tuple(parse_task(load_yaml(file)) for file in files)


@cache
def shelf(folder: Path) -> Sequence[Entry]:
    """The plans of a folder, by its index; none where there is no index."""
    index = folder / INDEX
    if not index.is_file():
        return ()
    with index.open(encoding="utf-8", newline="") as rows:
        return tuple(_entry(folder, row) for row in csv.DictReader(rows))


def _entry(folder: Path, row: Mapping[str, str]) -> Entry:
    figures = {name: float(row[name]) for name in FIGURES if row[name]}
    cost, of, landed = float(row["cost"]), int(row["of"]), int(row["landed"])
    return Entry(folder / row["file"], row["kind"], figures, cost, of, landed)
