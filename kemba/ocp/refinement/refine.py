"""Refining an implicit Euler plan: the same modes, solved again so that it replays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from kemba.model import Model
from kemba.ocp.certificate.certify import Certificate
from kemba.ocp.nlp.ipopt import SOLVED, Watch
from kemba.ocp.nlp.stagnation import GAVE_UP
from kemba.ocp.refinement.independent import Independent
from kemba.ocp.refinement.mode_constraints import add_mode_constraints
from kemba.ocp.refinement.modes import Phase, read_phases
from kemba.ocp.refinement.program import Program
from kemba.ocp.refinement.radau import RADAU3, RADAU5, STATE, Scheme
from kemba.ocp.refinement.repair import FITS, misfit, repaired, simplified
from kemba.ocp.refinement.requirements import add_requirements
from kemba.ocp.refinement.sample import certificate, to_trajectory
from kemba.ocp.refinement.solve import STOPPED, Control, PhaseSolution, solve
from kemba.ocp.refinement.start import carried, start_vector
from kemba.ocp.refinement.unilateral import read_constraints
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.task import Task
from kemba.ocp.transcription.solution import arrays
from kemba.ocp.transcription.symmetry import (
    Reduction,
    find_symmetry,
    requirements_are_symmetric,
    whole,
)
from kemba.trajectory import Trajectory

STOPS = (STOPPED, "Maximum_WallTime_Exceeded")
MIRRORED = 1e-6  # scaled; a plan that differs less from its mirror image is solved by half
PRICE = 1000.0  # of a rule giving way by its scale; cheaper, rules that could hold give way too
# weights of staying near the start: without, short steps of free duration wander off
NEAR, NEAR_ELASTIC, NEAR_FINE = 10.0, 1.0, 1.0
FAIR = 2.0  # times the nominal step; on longer elements two stages err, for lower costs
ROUNDS = 6  # elastic solves of one reading
ITERATIONS = {True: 300, False: 450}  # of all solves together, of half a robot and of a whole one
WARM: dict[str, Any] = {"mu_init": 1e-4, "bound_push": 1e-6, "bound_frac": 1e-6}
# the coarser scheme finds the way and which modes fit, the finer one makes it exact
ROUGH = {**WARM, "max_iter": 60, "tol": 1e-3, "constr_viol_tol": 1e-6}
NEAREST = {True: {**ROUGH, "max_iter": 50}, False: ROUGH}  # of half and whole robot
ELASTIC = {**ROUGH, "max_iter": 100, "mu_init": 0.1}
FINE = {**WARM, "max_iter": 60}


@dataclass(frozen=True)
class Refined:
    """A plan on phases: its trajectory, what it violates, how IPOPT ended and how long it took.

    `trajectory` and `certificate` are None where no program could be built or solved.
    """

    trajectory: Trajectory | None
    certificate: Certificate | None
    message: str
    iterations: int
    phases: tuple[Phase, ...] = ()

    @property
    def solved(self) -> bool:
        """Whether the finest scheme converged."""
        return self.trajectory is not None

    @property
    def stopped(self) -> bool:
        """Whether the user ended it."""
        return self.message == STOPPED


def refine(
    model: Model,
    task: Task,
    requirements: Sequence[Requirement],
    plan: Trajectory,
    reduction: Reduction | None = None,
    deadline: float = np.inf,
    log: Path | None = None,
    watch: Watch | None = None,
    stop: Callable[[], bool] | None = None,
) -> Refined:
    """The plan with its modes kept, phase durations free, and events where they happen.

    `reduction`: half or whole robot; by default the half where plan and task allow it. `deadline`
    is in time.monotonic(). `log` collects IPOPT's text. `watch` hears every iteration, `stop` is
    asked whether to end: the message then is IPOPT's for a user's stop.
    """
    reduction = reduction or reduction_of(model, task, requirements, plan)
    refiner = Refiner(
        model, task, requirements, plan, reduction, Control(deadline, log, watch, stop)
    )
    try:
        return refiner.run()
    except ValueError as error:
        return Refined(None, None, f"the model {error}", 0)


@dataclass
class Refiner:
    """Readings of a plan's modes, each repaired where it does not fit, until one solves."""

    model: Model
    task: Task
    requirements: Sequence[Requirement]
    plan: Trajectory
    reduction: Reduction
    control: Control
    iterations: int = 0
    seen: list[list[Phase]] = field(default_factory=list)  # whose modes were put to the test

    @property
    def marks(self) -> list[int]:
        """Nodes at which the task asks for something: phases end there."""
        return [w.node(len(self.plan) - 1) for w in self.requirements if w.at is not None]

    @property
    def left(self) -> int:
        """Iterations that may still be spent."""
        return ITERATIONS[self.reduction.symmetric] - self.iterations

    def run(self) -> Refined:
        """The first reading that solves, else how the last one ended."""
        constraints = read_constraints(self.model, self.reduction)
        inputs = self.reduction.restrict("u", arrays(self.model, self.plan)["u"])
        valves = np.round(inputs[:, _binary(self.model, self.reduction)])
        found = Refined(None, None, GAVE_UP, 0)
        for trim in (False, True):
            phases = read_phases(self.model, constraints, self.plan, valves, self.marks, trim)
            if phases in self.seen:
                break
            found = self.exact(phases, self.plan)
            if not found.solved and found.message not in STOPS:
                found = self.repair(phases, found)
            if found.solved or found.message in STOPS:
                break
        return replace(found, iterations=self.iterations)

    def repair(self, phases: list[Phase], found: Refined) -> Refined:
        """The solution on phases repaired until their modes fit, else how the last try ended."""
        start = self.plan
        for _ in range(ROUNDS):
            if phases in self.seen or self.left <= 0:
                break
            self.seen.append(phases)
            program, rough = self.rough(phases, start)
            if rough.message in STOPS:
                return self._ended(program, rough.message)
            if misfit(program, rough.x).max(initial=0.0) <= FITS:
                found = self.finish(program, rough.x)
                if found.solved or found.message in STOPS:
                    break
            better = repaired(program, rough.x, self.marks)
            if better is None:
                break
            phases, start = better, to_trajectory(program, rough.x)
        return found

    def exact(self, phases: Sequence[Phase], start: Trajectory) -> Refined:
        """The nearest solution on some phases by the coarser scheme, then the best by both."""
        program, x = self.build(phases, start, RADAU3)
        found = self._solve(program, program.anchor(x, NEAR), NEAREST[self.reduction.symmetric])
        if found.message not in SOLVED:
            return self._ended(program, found.message)
        return self.simpler(program, found.x) or self.finish(program, found.x)

    def simpler(self, program: Program, x: np.ndarray) -> Refined | None:
        """The solution without the phases that collapsed in x; None where it has none."""
        phases = simplified(program, x, self.marks)
        if phases is None or self.left <= 0:
            return None
        found = self.exact(phases, to_trajectory(program, x))
        return found if found.solved or found.message in STOPS else None

    def finish(self, near: Program, x: np.ndarray) -> Refined:
        """From the nearest solution x by the coarser scheme to a good one, to an exact one."""
        program, start = self.build(near.phases, self.plan, RADAU3)
        program.keep_short(x, FAIR)
        best = self._solve(program, x[: len(start)], ROUGH)
        found = self._ended(program, best.message)
        if best.message in SOLVED:
            simpler = self.simpler(program, best.x)
            if simpler is not None:
                return simpler
        for way in [best.x] * (best.message in SOLVED) + [x] * (best.message not in STOPS):
            found = self.fine(program, way)
            if found.solved or found.message in STOPS:
                break
        return found

    def rough(self, phases: Sequence[Phase], start: Trajectory) -> tuple[Program, PhaseSolution]:
        """The elastic program of the coarser scheme, solved."""
        program, x = self.build(phases, start, RADAU3, PRICE)
        x = program.loosened(program.anchor(x, NEAR_ELASTIC))
        return program, self._solve(program, x, ELASTIC)

    def fine(self, rough: Program, x: np.ndarray) -> Refined:
        """The exact program of the finer scheme, from a solution x of the coarser one."""
        program, _ = self.build(rough.phases, self.plan, RADAU5)
        start = program.anchor(carried(program, rough, x), NEAR_FINE)
        found = self._solve(program, start, FINE)
        if found.message not in SOLVED:
            return self._ended(program, found.message)
        trajectory = to_trajectory(program, found.x)
        measured = certificate(program, found.x, trajectory)
        phases = tuple(program.phases)
        return Refined(trajectory, measured, found.message, self.iterations, phases)

    def build(
        self, phases: Sequence[Phase], start: Trajectory, scheme: Scheme, elastic: float = 0.0
    ) -> tuple[Program, np.ndarray]:
        """The program of some phases and its start. Raises ValueError for other models."""
        constraints = read_constraints(self.model, self.reduction)
        program = Program(
            self.model, self.task, self.reduction, phases, constraints, scheme, elastic
        )
        x = start_vector(program, start)
        first, end = program.columns.first, program.columns.end(program.nodes)
        at_first = Independent({g: x[first[g]] for g in STATE})
        add_requirements(
            program, self.requirements, at_first, Independent({g: x[end[g]] for g in STATE})
        )
        add_mode_constraints(program, at_first)
        x = np.concatenate([x, np.zeros(program.columns.size - len(x))])
        return program, np.clip(x, program.lower, program.upper)

    def _solve(self, program: Program, start: np.ndarray, options: dict[str, Any]) -> PhaseSolution:
        options = {**options, "max_iter": max(0, min(options["max_iter"], self.left))}
        found = solve(program, start, options, self.control)
        self.iterations += found.iterations
        return found

    def _ended(self, program: Program, message: str) -> Refined:
        return Refined(None, None, message, self.iterations, tuple(program.phases))


def reduction_of(
    model: Model, task: Task, requirements: Sequence[Requirement], plan: Trajectory
) -> Reduction:
    """Half the robot where model, task and plan are their own mirror images, else the whole."""
    half = find_symmetry(model) if task.solver.symmetry else None
    if half is None or not requirements_are_symmetric(model, requirements):
        return whole(model.node)
    x = arrays(model, plan)
    for name, matrix in half.B.items():
        mean = half.expand(name, half.restrict(name, x[name]))
        if matrix.size and np.abs(mean - x[name]).max() > MIRRORED * max(1.0, np.abs(mean).max()):
            return whole(model.node)
    return half


def _binary(model: Model, reduction: Reduction) -> list[int]:
    places = [i for i, q in enumerate(model.inputs.values()) if q.binary]
    B = reduction.B["u"]
    return [j for j in range(B.shape[1]) if B[places, j].any()]
