"""Refining an implicit Euler plan: the same modes, solved again so that it replays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from kemba.events import LASTS
from kemba.model import Model
from kemba.ocp.certificate.certify import Certificate
from kemba.ocp.nlp.ending import Ending
from kemba.ocp.nlp.ipopt import Control, Iterate, central
from kemba.ocp.phases.between import add_missed
from kemba.ocp.phases.mesh import meshed
from kemba.ocp.phases.mode_constraints import (
    ContradictionError,
    Independent,
    add_mode_constraints,
    add_requirements,
)
from kemba.ocp.phases.modes import Phase, read_phases
from kemba.ocp.phases.program import PhaseProgram
from kemba.ocp.phases.radau import RADAU3, RADAU5, RADAU9, STATE, Scheme
from kemba.ocp.phases.settings import Refining
from kemba.ocp.phases.stages import Stages
from kemba.ocp.refinement.repair import (
    Misfitting,
    Solution,
    best_first,
    misfits,
    next_repair,
    settled,
    with_pulses,
)
from kemba.ocp.refinement.start import (
    carried,
    certificate,
    rough,
    solve,
    solve_along,
    start_vector,
    to_trajectory,
    warm,
)
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.task import Task
from kemba.ocp.transcription.solution import arrays
from kemba.ocp.transcription.symmetry import (
    Reduction,
    find_symmetry,
    requirements_are_symmetric,
    whole,
)
from kemba.ocp.transcription.unilateral import read_constraints
from kemba.stopwatch import Stage, Tell, silent
from kemba.trajectory import Trajectory

Order = list[tuple[tuple[int, ...], tuple[float, ...]]]  # modes and valves, phase by phase
Start = Trajectory | tuple[PhaseProgram, np.ndarray]  # nodes, or the scaled variables of a program
UNFIT = "no order of its contacts and stops was found that holds"
NEAREST, BEST, FINER = range(3)  # steps of an elastic program
STEPS = ("near the plan", "the best plan", "the best plan, more exactly")
FULL = 0.999  # of its longest duration: an element on its bound
SEVERAL = 3  # elements of a phase, on average


@dataclass(frozen=True)
class Refined:
    """A plan on phases: its trajectory, what it violates, how the last solve ended, iterations.

    `trajectory` and `certificate` are None where no program could be built or solved; `reason`
    says why a program could not be built. `stages`: the program's solution. `plain`: the plan
    before pulses were put in.
    """

    trajectory: Trajectory | None
    certificate: Certificate | None
    ending: Ending
    iterations: int
    phases: tuple[Phase, ...] = ()
    reason: str = ""
    stages: Stages | None = None
    plain: Refined | None = None

    @property
    def solved(self) -> bool:
        """Whether the finest scheme converged."""
        return self.trajectory is not None

    @property
    def done(self) -> bool:
        """Whether nothing else is to be tried: it is solved or was cut short."""
        return self.solved or self.ending.cut_short

    @property
    def sentence(self) -> str:
        """How it ended, in words."""
        return self.reason or self.ending.sentence


def refine(
    model: Model,
    task: Task,
    requirements: Sequence[Requirement],
    plan: Trajectory,
    control: Control | None = None,
    tell: Tell = silent,
    pulses: bool = True,
) -> Refined:
    """The plan solved again with its modes kept and the durations of its phases free.

    It is solved by half the robot where plan and task allow it. `tell` gets the name of every
    solve. `pulses`: of valves are put in where they lower the cost.
    """
    reduction = reduction_of(model, task, requirements, plan)
    refiner = Refiner(model, task, requirements, plan, reduction, control or Control(), tell)
    try:
        found = refiner.run()
        return refiner.improved(found) if pulses else found
    except ContradictionError as error:
        return Refined(None, None, Ending.UNSUITABLE, refiner.iterations, reason=str(error))
    except ValueError as error:
        return Refined(None, None, Ending.UNSUITABLE, 0, reason=f"the model {error}")


@dataclass
class Refiner:
    """Reads the modes of a plan, solves, and repairs modes that do not fit, until they do."""

    model: Model
    task: Task
    requirements: Sequence[Requirement]
    plan: Trajectory
    reduction: Reduction
    control: Control
    tell: Tell = silent
    iterations: int = 0
    seen: list[list[Phase]] = field(default_factory=list)  # phases that were tried
    solution: Solution | None = None  # by the finer scheme

    def marks(self, nodes: int) -> list[int]:
        """Those of `nodes` at which the task asks for something: phases end there."""
        return [w.node(nodes) for w in self.requirements if w.at is not None]

    @property
    def left(self) -> int:
        """Iterations that may still be spent."""
        return Refining.iterations - self.iterations

    def run(self) -> Refined:
        """The first reading that solves, else how the last one ended."""
        found = Refined(None, None, Ending.GAVE_UP, 0)
        for trim in (False, True):
            phases = self.phases(trim)
            if phases in self.seen:
                break
            found = self.fitted(phases)
            if found.done:
                break
        return replace(found, iterations=self.iterations)

    def phases(self, trim: bool = False) -> list[Phase]:
        """The phases of the plan; see `read_phases`. Raises ValueError for a model to which the
        method does not apply."""
        constraints = read_constraints(self.model, self.reduction)
        inputs = self.reduction.restrict("u", arrays(self.model, self.plan)["u"])
        valves = np.round(inputs[:, valve_columns(self.model, self.reduction)])
        brief = LASTS if self.task.clearance else 0.0
        asked = stands(self.requirements, len(self.plan))
        return read_phases(
            self.model,
            constraints,
            self.plan,
            valves,
            self.marks(len(self.plan) - 1),
            trim,
            brief,
            asked,
        )

    def improved(self, found: Refined) -> Refined:
        """A solved plan with the pulses of valves that lower its cost."""
        start = found.trajectory
        if self.solution is None or start is None:
            return found
        self.tell("phases: pulses that lower the cost")
        scheme = self.solution[0].scheme
        best = with_pulses(self.solution, lambda p: self.build(p, start, scheme)[0], self.control)
        if best is self.solution:
            return found
        made = replace(read(*best), plain=found, iterations=self.iterations)
        keeps = made.certificate is not None and made.certificate.within(self.task.tolerances)
        return made if keeps else found

    def fitted(self, phases: list[Phase]) -> Refined:
        """The solution on phases, repaired until their modes fit, else how the last try ended.

        All programs are elastic, also the last one, on which IPOPT often does not converge without
        slacks; modes that fit are kept to its tolerance. Repairs are sought best first: those of
        the order of modes that came furthest and is violated least.
        """
        known: list[Misfitting] = []
        start: Start = self.plan
        found = Refined(None, None, Ending.ITERATION_LIMIT, 0)
        while self.left > 0:
            if self.seen:
                self.tell("phases: changing the order of contacts and valves")
            self.seen.append(phases)
            for step, name in enumerate(STEPS):
                self.tell(Stage(f"phases: {name}", step + 1, len(STEPS)))
                program, near = self.elastic(phases, start, step)
                start, found = (program, near.Y), ended(program, near)
                if found.ending.cut_short:
                    return found
                if not near.solved:
                    break
                wrong = misfits(program, near.Y) if step != NEAREST else []
                if wrong:
                    found = replace(found, reason=UNFIT)
                    known = best_first([*known, Misfitting(step, program, near.Y, wrong)])
                    break
                phases = self.evened(program, near)
            else:
                found = self.finished(phases, start)
                if found.done:
                    return found
            better = next_repair(known, self.seen, self.marks)
            if better is None:
                break
            phases, start = better
        return found

    def elastic(
        self, phases: Sequence[Phase], start: Start, step: int
    ) -> tuple[PhaseProgram, Iterate]:
        """The elastic program of a step: near the start by the coarser scheme, at a low price of
        slacks, then for the task's cost, then for that near the start by the finer scheme."""
        scheme = RADAU5 if step == FINER else RADAU3
        price = Refining.first_price if step == NEAREST else Refining.price
        program, x = self.build(phases, start, scheme, price)
        if step != BEST:
            x = program.proximal(x, Refining.near)
        options = (warm if step == FINER else rough)(Refining.long_iterations)
        options["mu_init"] = Refining.elastic_mu / 10**step
        return program, self._solve(program, program.loosened(x), options)

    def finished(self, phases: Sequence[Phase], near: Start) -> Refined:
        """The solution by the finer scheme from one `near`; once more on other elements where a
        phase would last longer than its own can."""
        solution = self.last_solve(phases, near, RADAU5)
        even = self.evened(*solution) if solution[1].solved else phases
        if even != phases:
            self.tell("phases: on elements shared by how long phases last")
            again = self.last_solve(even, (solution[0], solution[1].Y), RADAU5)
            solution = again if again[1].solved else solution
        if solution[1].solved:
            self.solution = solution
        return read(*solution)

    def last_solve(
        self,
        phases: Sequence[Phase],
        near: Start,
        scheme: Scheme,
        more: Callable[[PhaseProgram], None] = lambda program: None,
    ) -> Solution:
        """The program of a finer scheme solved for the task's cost, from a start `near` its
        solution; not solved where modes do not fit. `more` adds rows to it."""
        program, x = self.build(phases, near, scheme, Refining.price)
        more(program)
        options = warm(Refining.long_iterations) | central(Refining.mu, Refining.push)
        found = self._solve(program, program.loosened(x), options)
        if not found.solved:
            return program, found
        fits = not misfits(program, found.Y, self.task.tolerances.bounds)
        return program, settled(program, found if fits else replace(found, ending=Ending.GAVE_UP))

    def evened(self, program: PhaseProgram, found: Iterate) -> list[Phase]:
        """The phases of a program; where one of them lasts as long in a solution as its elements
        can, on three elements a phase at least, shared by how long they last."""
        h = program.columns.h[:, 0]
        if not (found.Y[h] > FULL * program.upper[h]).any():
            return program.phases
        lasts = [p.elements * float(x) for p, x in zip(program.phases, found.Y[h], strict=True)]
        nodes = max(program.nodes, SEVERAL * len(lasts))
        asked = [w for w in self.requirements if w.location[0] != "contacts"]
        fractions = [at for w in asked for at in (w.during if w.at is None else (w.at,))]
        return meshed(program.phases, lasts, nodes, fractions) or program.phases

    def build(
        self, phases: Sequence[Phase], start: Start, scheme: Scheme, elastic: float = 0.0
    ) -> tuple[PhaseProgram, np.ndarray]:
        """The program of some phases and its start (size,), scaled; with rows between nodes where
        that is near to what it keeps off, if there are corners to be cut, or most stages. Raises
        ValueError for a model to which the method does not apply."""
        constraints = read_constraints(self.model, self.reduction)
        program = PhaseProgram(
            self.model, self.task, self.reduction, phases, constraints, scheme, elastic
        )
        if isinstance(start, Trajectory):
            x = start_vector(program, start)
        else:
            near, own = start
            x = carried(program, near.columns, near.scheme.points, own)
        first, end = program.columns.first, program.columns.end(program.nodes)
        at_first = Independent({g: x[first[g]] for g in STATE})
        at_last = Independent({g: x[end[g]] for g in STATE})
        add_requirements(program, self.requirements, at_first, at_last)
        add_mode_constraints(program, at_first)
        x = np.concatenate([x, np.zeros(program.columns.size - len(x))])
        if self.task.scene.cornered or scheme is RADAU9:
            add_missed(program, x, Refining.near_rows)
        return program, np.clip(x, program.lower, program.upper)

    def _solve(self, program: PhaseProgram, start: np.ndarray, options: dict[str, Any]) -> Iterate:
        options = {**options, "max_iter": max(0, min(options["max_iter"], self.left))}
        way = solve if program.scheme is RADAU3 else solve_along
        found = way(program, Iterate(start), options, self.control)
        self.iterations += found.iterations
        return found


def ended(program: PhaseProgram, last: Iterate) -> Refined:
    """How a solve of a program ended, without a plan."""
    assert last.ending is not None
    return Refined(None, None, last.ending, last.iterations, tuple(program.phases))


def read(program: PhaseProgram, last: Iterate) -> Refined:
    """What a solve of a program gave: a plan where it is solved."""
    found = ended(program, last)
    if not last.solved:
        return found
    trajectory = to_trajectory(program, last.Y)
    measured, own = certificate(program, last.Y, trajectory), Stages.of(program, last)
    return replace(found, trajectory=trajectory, certificate=measured, stages=own)


def stands(requirements: Sequence[Requirement], rows: int) -> dict[str, np.ndarray]:
    """Whether a foot stands at each of the `rows` (rows,), by the label of its contact, as the
    task's `contacts` say; empty where it says nothing."""
    found: dict[str, np.ndarray] = {}
    for asked in (r for r in requirements if r.location[0] == "contacts"):
        leg, _, what = asked.quantity.name.partition("/")
        on = found.setdefault(f"{leg}/contact:gap", np.zeros(rows, dtype=bool))
        if what != "foot/Fz":  # its gap is zero; of a foot in the air the force is
            on[asked.nodes(rows - 1)] = True
    for on in found.values():
        on[0] = on[1]  # forces, and so stances, are those of the intervals before a node
    return found


def order_of(
    model: Model, task: Task, requirements: Sequence[Requirement], plan: Trajectory
) -> Order | None:
    """In which order a plan's contacts, stops and valves come: plans with the same one are refined
    by the same program. None for a model to which the method does not apply."""
    reduction = reduction_of(model, task, requirements, plan)
    try:
        phases = Refiner(model, task, requirements, plan, reduction, Control()).phases()
    except ValueError:
        return None
    return [(phase.modes, phase.valves) for phase in phases]


def reduction_of(
    model: Model, task: Task, requirements: Sequence[Requirement], plan: Trajectory
) -> Reduction:
    """Half the robot where model, task and plan are their own mirror images, else the whole."""
    half = find_symmetry(model) if task.solver.symmetry else None
    if half is None or not requirements_are_symmetric(model, requirements):
        return whole(model.node)
    x, mirrored = arrays(model, plan), Refining.mirrored
    x["q"] = x["q"] - np.array(model.mechanism.origin)
    for name, matrix in half.B.items():
        mean = half.expand(name, half.restrict(name, x[name]))
        if matrix.size and np.abs(mean - x[name]).max() > mirrored * max(1.0, np.abs(mean).max()):
            return whole(model.node)
    return half


def valve_columns(model: Model, reduction: Reduction) -> list[int]:
    """Places of the valves among the inputs of a half or whole robot."""
    places = [i for i, q in enumerate(model.inputs.values()) if q.binary]
    B = reduction.B["u"]
    return [j for j in range(B.shape[1]) if B[places, j].any()]
