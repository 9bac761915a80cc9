"""Strategies of finding a plan in turn, from coarse to fine and half to whole robot."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from kemba.model import Model
from kemba.ocp.infeasibility.elastic import Outcome, elastic
from kemba.ocp.nlp.ipopt import Ipopt, Iterate, Watch
from kemba.ocp.planned import Plan, judge
from kemba.ocp.relaxation.guess import automatic_guess
from kemba.ocp.relaxation.lifting import confirm, grow
from kemba.ocp.relaxation.penalty import WEIGHTS, penalise
from kemba.ocp.relaxation.resume import resumed
from kemba.ocp.relaxation.schedule import (
    RELAX,
    Attempt,
    Schedule,
    Stopped,
    binary,
    find,
    refine,
    tighten,
)
from kemba.ocp.relaxation.valve_search import search_neighbourhood
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.task import Task
from kemba.ocp.transcription.symmetry import Reduction, find_symmetry, mirrored_requirements, whole
from kemba.ocp.transcription.transcribe import Transcription
from kemba.stopwatch import Stopwatch
from kemba.trajectory import Trajectory

COARSEST, FINE = 24, 80  # nodes: no grid is coarser, and valves are sought on none finer


def grids(nodes: int) -> list[int]:
    """Numbers of nodes from coarse to fine, each about half of the next."""
    found = [nodes // 2, nodes]
    while found[0] > FINE:
        found.insert(0, found[0] // 2)
    return found


@dataclass
class Planner:
    """Builds programs of one task on demand and solves them by a list of strategies."""

    task: Task
    model: Model
    requirements: list[Requirement]
    log: Path | None = None
    tell: Callable[[str], None] = lambda text: None
    watch: Watch | None = None
    attempts: list[Attempt] = field(default_factory=list)
    building: Stopwatch = field(default_factory=Stopwatch)
    deadline: float = np.inf
    start: Trajectory | None = None
    stop: Callable[[], bool] | None = None
    outcome: Outcome | None = None  # of the elastic solve after a failure

    def search(self, nodes: int, reduction: Reduction) -> Schedule:
        """A fresh program on a grid of `nodes`; of half a robot, for what is asked of both legs
        alike."""
        requirements = self.alike if reduction.symmetric else self.requirements
        with self.building.running():
            transcription = Transcription(self.model, self.task, requirements, reduction, nodes)
        options = {"max_iter": self.task.solver.max_iterations, **self.task.solver.options}
        ipopt = Ipopt(
            transcription, options, self.log, self.deadline, self.watch, self.stop, self.building
        )
        name = "half" if reduction.symmetric else "whole"

        def tell(text: str) -> None:
            self.tell(f"{text} ({name} robot, {nodes} nodes)")

        return Schedule(ipopt, self.task.solver.complementarity, tell, self.attempts)

    def guess(self, transcription: Transcription) -> Iterate:
        """The automatic start guess on a program's grid."""
        t = transcription
        return Iterate(automatic_guess(self.model, self.task, self.requirements, t.layout, t.nodes))

    @cached_property
    def half(self) -> Reduction | None:
        """Half the robot, where the model is its own mirror image and symmetry may be used."""
        return find_symmetry(self.model) if self.task.solver.symmetry else None

    @cached_property
    def alike(self) -> list[Requirement]:
        """The requirements whose mirror images are required as well."""
        return mirrored_requirements(self.model, self.requirements)

    def reductions(self) -> Iterator[Reduction]:
        """Half robot first where model and task are mirror images of themselves."""
        if self.half is not None and self.alike == self.requirements:
            yield self.half
        yield whole(self.model.node)

    def strategies(self) -> Iterator[Callable[[], tuple[Transcription, Iterate]]]:
        """Ways to a plan, the quickest first; from the given start before any guess."""
        nodes = self.task.nodes
        for reduction in self.reductions() if self.start is not None else ():
            yield lambda r=reduction: self._continued(r)  # type: ignore[misc]
        for reduction in self.reductions():
            if self.task.solver.coarse and nodes // 2 >= COARSEST:
                yield lambda r=reduction: self._coarse_to_fine(r)  # type: ignore[misc]
            yield lambda r=reduction: self._direct(r)  # type: ignore[misc]

    def _coarse_to_fine(self, reduction: Reduction) -> tuple[Transcription, Iterate]:
        first, *finer = grids(self.task.nodes)
        search = self.search(first, reduction)
        point = self._sought(search)
        for nodes in finer:
            if not point.solved:
                return search.transcription, point
            coarse, search = search, self.search(nodes, reduction)
            point = refine(search, coarse.transcription, point)
        return self._finish(search, point)

    def _direct(self, reduction: Reduction) -> tuple[Transcription, Iterate]:
        search = self.search(self.task.nodes, reduction)
        return self._finish(search, self._sought(search))

    def _continued(self, reduction: Reduction) -> tuple[Transcription, Iterate]:
        assert self.start is not None
        search = self.search(self.task.nodes, reduction)
        point = binary(search, resumed(search.transcription, self.start))
        return self._finish(search, self._searched_nearby(search, point))

    def _sought(self, search: Schedule) -> Iterate:
        """A plan with binary valves: grown from half a robot's where legs are equal and only the
        requirements differ, else from the guess."""
        t, rounds = search.transcription, self.task.solver.valve_search
        if self.half is not None and self.alike != self.requirements:
            half = self.search(t.nodes, self.half)
            point = find(half, self.guess(half.transcription))
            if point.solved:
                point = grow(search, half.transcription, point, self.guess(t))
            if point.solved:
                return search_neighbourhood(search, point, rounds - 1, best=point)
        return self._searched_nearby(search, find(search, self.guess(t)))

    def _searched_nearby(self, search: Schedule, point: Iterate) -> Iterate:
        if not point.solved:
            return point
        return search_neighbourhood(search, point, self.task.solver.valve_search)

    def _finish(self, search: Schedule, point: Iterate) -> tuple[Transcription, Iterate]:
        point = tighten(search, point) if point.solved else point
        if not point.solved or not search.transcription.reduction.symmetric:
            return search.transcription, point
        full = self.search(self.task.nodes, whole(self.model.node))
        return full.transcription, confirm(full, search.transcription, point)

    def penalty(self) -> tuple[Transcription, Iterate]:
        """The paper's way, on the whole robot."""
        search = self.search(self.task.nodes, whole(self.model.node))
        start = self.guess(search.transcription)
        return search.transcription, penalise(search, start, self.task.method)

    def run(self) -> tuple[Transcription, Iterate]:
        """The first strategy that solves, else where the first one ended; a stop keeps its
        iterate."""
        try:
            if self.task.method in WEIGHTS:
                return self.penalty()
            first = None
            for strategy in self.strategies():
                found = strategy()
                if found[1].solved:
                    return found
                first = first or found
                if self.attempts[-1].name == RELAX and self.outcome is None:
                    self.outcome = elastic(self, next(self.reductions()))
                    if self.outcome is not None and self.outcome.short:
                        return first
            assert first is not None
            self.outcome = self.outcome or elastic(self, next(self.reductions()))
            return first
        except Stopped as stop:
            return stop.transcription, stop.point

    def refuse(self) -> tuple[Transcription, Iterate]:
        """Nothing solved: the start guess, for a task that a check refused."""
        whole_robot = whole(self.model.node)
        program = Transcription(
            self.model, self.task, self.requirements, whole_robot, self.task.nodes
        )
        return program, replace(self.guess(program), message="Infeasible_Problem_Detected")


def searched(planner: Planner, refused: bool) -> Plan:
    """What the strategies find, judged; the start guess for a task that a check refused."""
    before = replace(planner.building)
    searching = Stopwatch()
    with searching.running():
        transcription, point = planner.refuse() if refused else planner.run()
    wall = searching.wall - (planner.building.wall - before.wall)
    cpu = searching.cpu - (planner.building.cpu - before.cpu)
    return judge(planner, transcription, point, wall, cpu)
