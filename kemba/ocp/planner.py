"""Strategies of finding a plan in turn, from coarse to fine and half to whole robot."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from kemba.model import Model
from kemba.ocp.infeasibility.elastic import Outcome, elastic
from kemba.ocp.nlp.ending import Ending
from kemba.ocp.nlp.ipopt import Iterate
from kemba.ocp.planned import Plan, judge
from kemba.ocp.relaxation.guess import automatic_guess
from kemba.ocp.relaxation.schedule import (
    PENALTIES,
    RELAX,
    binary,
    confirm,
    find,
    fix,
    grow,
    penalise,
    refine_grid,
    relax_stepwise,
    resumed,
    seek_again,
    tighten,
)
from kemba.ocp.relaxation.session import Schedule, Session, Stopped
from kemba.ocp.relaxation.settings import Grids
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.task import Task
from kemba.ocp.transcription.level import GroundRise
from kemba.ocp.transcription.symmetry import (
    Reduction,
    equal_legs,
    find_symmetry,
    met_alike,
    mirrored_requirements,
    whole,
)
from kemba.ocp.transcription.transcribe import Transcription
from kemba.trajectory import Trajectory


def grids(nodes: int, duration: float) -> list[int]:
    """Numbers of nodes from coarse to fine, each about half of the next, of a motion that lasts
    `duration` [s]."""
    found = [nodes // 2, nodes]
    while found[0] > Grids.finest and duration <= Grids.longest * (found[0] // 2):
        found.insert(0, found[0] // 2)
    return found


@dataclass
class Planner:
    """Builds programs of one task on demand and solves them by a list of strategies.

    `lags`: the model with first-order chambers in the place of physical ones, and what is asked of
    it; plans are sought on it before they are refined on the model itself. `level`: whether plans
    in a scene with walls are sought on level ground; `scene`: the planner in it for which this one
    has level ground, with its `rises`.
    """

    task: Task
    model: Model
    requirements: list[Requirement]
    session: Session = field(default_factory=Session)
    start: Trajectory | None = None
    pulse: float = 0.0  # [s], of valves that are sought; the task's dwell where that is more
    outcome: Outcome | None = None  # of the elastic solve after a failure
    lags: tuple[Model, list[Requirement]] | None = None
    level: bool = False
    scene: Planner | None = None
    rises: tuple[GroundRise, ...] = ()

    @property
    def seeking(self) -> Planner:
        """The planner of the model on which plans are sought."""
        if self.lags is None:
            return self
        model, requirements = self.lags
        return replace(self, model=model, requirements=requirements, lags=None)

    def schedule(self, nodes: int, reduction: Reduction) -> Schedule:
        """A fresh program on a grid of `nodes`; of half a robot, for what is asked of both legs
        alike."""
        if reduction is self.one_leg:
            requirements = met_alike(self.model, self.requirements, reduction)
        else:
            requirements = self.alike if reduction.symmetric else self.requirements
        with self.session.building.running():
            known = self.model, self.task, requirements, reduction, nodes
            program = Transcription(*known, self.rises)
        options = {"max_iter": self.task.solver.max_iterations, **self.task.solver.options}
        name = "half" if reduction.symmetric else "whole"
        name = "one leg for all of the" if reduction is self.one_leg else name
        where = f" ({name} robot, {nodes} nodes)"
        return self.session.schedule(program, options, where, self.pulse)

    def guess(self, transcription: Transcription) -> Iterate:
        """The automatic start guess on a program's grid, of the scene's course."""
        t, own = transcription, self.scene or self
        Y = automatic_guess(own.model, own.task, own.requirements, t.layout, t.nodes)
        return Iterate(np.clip(t.raised(Y, -1.0), t.layout.lower, t.layout.upper))

    @cached_property
    def half(self) -> Reduction | None:
        """Half the robot, where the model is its own mirror image and symmetry may be used."""
        return find_symmetry(self.model) if self.task.solver.symmetry else None

    @cached_property
    def one_leg(self) -> Reduction | None:
        """One leg for all of a robot with more than two, where symmetry may be used."""
        return equal_legs(self.model) if self.task.solver.symmetry else None

    @cached_property
    def alike(self) -> list[Requirement]:
        """The requirements whose mirror images are required as well."""
        return mirrored_requirements(self.model, self.requirements)

    @property
    def coarse(self) -> bool:
        """Whether plans are sought on a coarser grid first."""
        return self.task.solver.coarse and self.task.nodes // 2 >= Grids.coarsest

    @property
    def together(self) -> bool:
        """Whether all legs stand together, as far as `contacts` says: half a robot knows nothing
        of legs that stand one after the other."""
        legs = self.model.mechanism.need_robot().legs if self.task.contacts else ()
        return all(len(part.on) in (0, len(legs)) for part in self.task.contacts)

    def reductions(self) -> Iterator[Reduction]:
        """Half robot first where model and task are mirror images of themselves."""
        if self.half is not None and self.alike == self.requirements:
            yield self.half
        yield whole(self.model.node)

    def strategies(self) -> Iterator[Callable[[], tuple[Transcription, Iterate]]]:
        """Ways to a plan, the quickest first; from the given start before any guess."""
        for reduction in self.reductions() if self.start is not None else ():
            yield lambda r=reduction: self._continued(r)  # type: ignore[misc]
        for reduction in self.reductions():
            if self.coarse:
                yield lambda r=reduction: self._coarse_to_fine(r)  # type: ignore[misc]
            if self.scene is None:
                yield lambda r=reduction: self._direct(r)  # type: ignore[misc]

    def _coarse_to_fine(self, reduction: Reduction) -> tuple[Transcription, Iterate]:
        first, *finer = grids(self.task.nodes, self.task.duration)
        schedule = self.schedule(first, reduction)
        point = self._sought(schedule)
        for nodes in finer:
            if not point.solved:
                return schedule.transcription, point
            coarse, schedule = schedule, self.schedule(nodes, reduction)
            known = schedule, coarse.transcription, point
            point = refine_grid(*known) if self.scene is None else seek_again(*known)
        return self._finish(schedule, point)

    def _direct(self, reduction: Reduction) -> tuple[Transcription, Iterate]:
        schedule = self.schedule(self.task.nodes, reduction)
        return self._finish(schedule, self._sought(schedule))

    def _continued(self, reduction: Reduction) -> tuple[Transcription, Iterate]:
        assert self.start is not None
        schedule = self.schedule(self.task.nodes, reduction)
        point = binary(schedule, resumed(schedule.transcription, self.start))
        return self._finish(schedule, self._fixed(schedule, point))

    def _sought(self, schedule: Schedule) -> Iterate:
        """A plan with binary valves: grown from half a robot's where legs are equal and only the
        requirements differ, else from the guess. On level ground for walls a relaxed one: its
        valves are sought on the finer grid, which rounded on this one they seldom fit."""
        t = schedule.transcription
        if self.scene is not None:
            sides = {r.label for r in self.requirements}
            sides -= {r.label for r in self.scene.requirements}
            rows = np.array([m.label in sides for m in t.meanings])
            return relax_stepwise(schedule, self.guess(t), rows)
        fewer = self.one_leg
        if self.half is not None and self.alike != self.requirements:
            fewer = self.half
        if fewer is not None and self.together:
            half = self.schedule(t.nodes, fewer)
            point = find(half, self.guess(half.transcription))
            if point.solved:
                point = grow(schedule, half.transcription, point, self.guess(t))
            if point.solved:
                return point
        return self._fixed(schedule, find(schedule, self.guess(t)))

    def _fixed(self, schedule: Schedule, point: Iterate) -> Iterate:
        return fix(schedule, point) if point.solved else point

    def _finish(self, schedule: Schedule, point: Iterate) -> tuple[Transcription, Iterate]:
        point = tighten(schedule, point) if point.solved else point
        if not point.solved or not schedule.transcription.reduction.symmetric:
            return schedule.transcription, point
        full = self.schedule(schedule.transcription.nodes, whole(self.model.node))
        return full.transcription, confirm(full, schedule.transcription, point)

    def penalty(self) -> tuple[Transcription, Iterate]:
        """The paper's way, on the whole robot."""
        schedule = self.schedule(self.task.nodes, whole(self.model.node))
        start = self.guess(schedule.transcription)
        return schedule.transcription, penalise(schedule, start, self.task.method)

    def run(self) -> tuple[Transcription, Iterate]:
        """The result of the first strategy that solves, else of the first one; the best iterate of
        a solve that was stopped."""
        try:
            if self.task.method in PENALTIES:
                return self.penalty()
            first = None
            for strategy in self.strategies():
                found = strategy()
                if found[1].solved:
                    return found
                first = first or found
                if self.session.attempts[-1].name == RELAX and self.outcome is None:
                    self.outcome = self.elastic()
                    if self.outcome is not None and self.outcome.short:
                        return first
            assert first is not None
            self.outcome = self.outcome or self.elastic()
            return first
        except Stopped as stop:
            return stop.transcription, stop.point

    def elastic(self) -> Outcome | None:
        """Which requirements an elastic solve violates; None on ground that is not the task's."""
        if self.scene is not None:
            return None
        reduction = next(self.reductions())
        return elastic(self.model, self.task, self.requirements, reduction, self.session)

    def refuse(self) -> tuple[Transcription, Iterate]:
        """Nothing solved: the start guess, for a task that a check refused."""
        whole_robot = whole(self.model.node)
        program = Transcription(
            self.model, self.task, self.requirements, whole_robot, self.task.nodes
        )
        return program, replace(self.guess(program), ending=Ending.REFUSED)


def searched(planner: Planner, refused: bool) -> Plan:
    """What the strategies find, judged; the start guess for a task that a check refused."""
    transcription, point = planner.refuse() if refused else planner.run()
    own = planner.scene or planner
    return judge(own.model, own.requirements, transcription, point)
