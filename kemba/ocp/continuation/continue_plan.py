"""The earlier plan solved again for changed figures, on its own phases; or with its valve edges on
the ticks of the controller.

A table with many short pulses loses millimetres when its edges are rounded afterwards. With the
edges on ticks beforehand the plan is the best one that a table can hold.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from math import ceil
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from kemba.errors import KembaError
from kemba.model import Model
from kemba.ocp.certificate.certify import objective
from kemba.ocp.continuation.origin import Origin, completed
from kemba.ocp.controller import PERIOD, ValveEdges, rounded
from kemba.ocp.nlp import ipopt
from kemba.ocp.nlp.ending import Ending, Stagnation
from kemba.ocp.nlp.ipopt import Control, Iterate
from kemba.ocp.phases.mesh import meshed
from kemba.ocp.phases.mode_constraints import ContradictionError
from kemba.ocp.phases.modes import Phase, noted_phases
from kemba.ocp.phases.program import PhaseProgram
from kemba.ocp.phases.radau import RADAU5, RADAU9
from kemba.ocp.phases.settings import Refining
from kemba.ocp.phases.stages import Stages
from kemba.ocp.refinement.refine import Refined, Refiner, read, reduction_of, refine, valve_columns
from kemba.ocp.refinement.start import on_elements, solve_along, warm
from kemba.ocp.relaxation.session import Attempt
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.task import Task
from kemba.ocp.transcription.layout import STEP
from kemba.ocp.transcription.symmetry import Reduction
from kemba.ocp.transcription.unilateral import read_constraints
from kemba.trajectory import Array, Trajectory


# Those without a reason: tried on jump and jump_forward with other heights, supplies, payloads and
# distances.
class Continuing:
    """How an earlier plan is solved again for changed figures."""

    iterations = 60  # of each solve; those that converged took 16 to 46
    # first iterations without a smaller violation, after which a solve is given up; those that
    # converged had none for 9 at most
    patience = 10
    underway = 0.5  # scaled violation below which a solve is no longer given up for that
    # how much rather impulses of the start change than its velocities, scaled: a trajectory says
    # nothing of impulses
    ease = 1e3
    push = 1e-3  # distance from the bounds of such a start
    # times the earlier plan's cost beyond which another minimum is likely: more than such a change
    # usually asks for
    dear = 3.0

    @classmethod
    def most(cls, before: float) -> float:
        """The most that a plan may cost which is continued from one that cost `before`."""
        return before + (cls.dear - 1.0) * abs(before)


class Mesh(NamedTuple):
    """An earlier plan on the task's nodes, and the solved program to begin with, if one fits."""

    start: Trajectory
    phases: list[Phase]
    stages: Stages | None


@dataclass
class Continuation:
    """From an earlier plan to the one that is asked; `steps` collects how its solves ended."""

    model: Model
    task: Task
    requirements: Sequence[Requirement]
    origin: Origin
    control: Control
    tell: Callable[[str], None] = lambda text: None
    steps: list[Attempt] = field(default_factory=list)
    size: tuple[int, int] = (0, 0)  # variables and rows of the last program

    def run(self) -> Refined:
        """The plan on the phases of the earlier one; where these do not fit, on phases read
        anew."""
        try:
            start = completed(self.origin.plan, self.model)
            reduction = reduction_of(self.model, self.task, self.requirements, start)
            for mesh in self._meshes(start, reduction):
                found = self._solved(mesh, reduction)
                if found.ending.cut_short or self._is_kept(found):
                    return found
                if self.origin.ticks or self.origin.finer:
                    break
            if self.origin.once:
                return Refined(None, None, Ending.GAVE_UP, 0)
            return self._read_anew(start)
        except KembaError as error:
            why = f"the earlier plan does not fit this model: {error}"
            return Refined(None, None, Ending.UNSUITABLE, 0, reason=why)
        except ContradictionError as error:
            return Refined(None, None, Ending.UNSUITABLE, 0, reason=str(error))
        except ValueError as error:
            return Refined(None, None, Ending.UNSUITABLE, 0, reason=f"the model {error}")

    def _meshes(self, start: Trajectory, reduction: Reduction) -> Iterator[Mesh]:
        """The earlier plan on the task's nodes: in proportion to those of its phases, where its
        stages are known, and on no fewer than it has; then shared by how long phases last. Nothing
        where its notes do not fit."""
        constraints = read_constraints(self.model, reduction)
        valves = len(valve_columns(self.model, reduction))
        phases = noted_phases(start.meta, constraints, valves, len(start) - 1)
        if phases is None:
            return
        marks = [r.at for r in self.requirements if r.at is not None]
        stages, nodes = self.origin.stages, self.task.nodes
        if stages is not None and tuple(phases) == stages.phases:
            finer = renoded(start, phases, max(nodes, stages.nodes), marks, even=False)
            if finer is not None:
                yield Mesh(*finer, stages)
        even = renoded(start, phases, nodes, marks)
        if even is not None:
            yield Mesh(*even, None)

    def _is_kept(self, found: Refined) -> bool:
        """Whether a plan keeps to the tolerances, and costs not so much more than the earlier one
        that another minimum is likely."""
        new, measured, o = found.trajectory, found.certificate, self.origin
        if new is None or measured is None or not measured.within(self.task.tolerances):
            return False
        before = objective(o.model, self.task, o.requirements, o.plan)
        cost = objective(self.model, self.task, self.requirements, new)
        return cost <= Continuing.most(before)

    def _solved(self, mesh: Mesh, reduction: Reduction) -> Refined:
        """The best plan in one solve: from the stages, and with the multipliers where they are
        known for these elements, else from the nodes of the trajectory."""
        self.tell(f"from {self.origin.name}: the best one")
        refiner = Refiner(
            self.model, self.task, self.requirements, mesh.start, reduction, self.control
        )
        most = mesh.stages is not None and mesh.stages.stages == RADAU9.stages
        program, x = refiner.build(mesh.phases, mesh.start, RADAU9 if most else RADAU5)
        kept = on_elements(program, mesh.stages) if mesh.stages is not None else None
        x = with_impacts(program, x, Continuing.ease) if kept is None else kept
        if self.origin.finer and kept is not None:
            program, x = refiner.build(mesh.phases, (program, x), RADAU9)
        begin = Iterate(x)
        options = warm(min(Continuing.iterations, self.task.solver.max_iterations))
        mu = ipopt.last_barrier(Refining.tol)
        known: dict[str, Any] = {}

        def ticks(program: PhaseProgram) -> None:
            if self.origin.ticks:
                on_ticks(program, x)

        ticks(program)
        if mesh.stages is not None and mesh.stages.phases == tuple(mesh.phases):
            begin = mesh.stages.iterate(program, x)
        if begin.lam_g is not None:
            # a multiplier is at least that of a bound at distance 1
            known = ipopt.warm(mu, Continuing.push, warm_start_mult_bound_push=mu)
        elif kept is not None:
            known = ipopt.central(mu, Refining.push)
        stagnation = Stagnation(Continuing.patience, Continuing.underway, Refining.slow)
        found = solve_along(program, begin, options | known, self.control, stagnation)
        if not found.solved and kept is not None:
            program, found = refiner.last_solve(mesh.phases, (program, x), program.scheme, ticks)
        assert found.ending is not None
        self.steps.append(Attempt("from the earlier plan", found.ending, found.iterations))
        self.size = len(program.lower), len(program.rows)
        return read(program, found)

    def _read_anew(self, start: Trajectory) -> Refined:
        self.tell(f"from {self.origin.name}: its phases read anew")
        known = self.model, self.task, self.requirements, start
        found = refine(*known, self.control, self.tell, pulses=False)  # the plan has its own
        self.steps.append(Attempt("phases read anew", found.ending, found.iterations))
        return found


def with_impacts(program: PhaseProgram, x: np.ndarray, ease: float) -> np.ndarray:
    """x (size,) with velocities after impacts and impulses that meet the rows of the impact.

    Velocities at the end of the first element after it are carried back to its begin, then changed
    as little as the rows need; those of the element's stages lie in between. `ease`: how much
    rather impulses change than velocities.
    """
    x, c = x.copy(), program.columns
    if not program.impacts:
        return x
    own = len(c.after[program.impacts[0]]) + len(c.impulse[program.impacts[0]])
    unknown = program.jump.z[-own:]
    rows = ca.Function(
        "rows", [program.jump.z], [program.jump.g, ca.jacobian(program.jump.g, unknown)]
    )
    for p in program.impacts:
        first = program.phases[p].first
        last = min(first + 1, program.nodes - 1)
        begin, ends = c.end(first), [c.stages[e][-1]["v"] for e in (first, last)]
        if program.phases[p].elements > 1:
            x[c.after[p]] = 2.0 * x[ends[0]] - x[ends[1]]
        at = np.concatenate([begin["q"], begin["v"], begin["s"], c.after[p], c.impulse[p]])
        columns = at[-own:]
        free = program.lower[columns] < program.upper[columns]
        g, slope = (np.array(part) for part in rows(x[at]))
        weights = np.where(np.isin(columns, c.impulse[p]), ease, 1.0)[free]
        x[columns[free]] -= weights * (np.linalg.pinv(slope[:, free] * weights) @ g.ravel())
        for stage, share in zip(c.stages[first], program.scheme.points, strict=True):
            x[stage["v"]] = x[c.after[p]] + share * (x[ends[0]] - x[c.after[p]])
    return np.asarray(np.clip(x, program.lower, program.upper))


def renoded(
    plan: Trajectory, phases: Sequence[Phase], nodes: int, marks: Sequence[float], even: bool = True
) -> tuple[Trajectory, list[Phase]] | None:
    """The plan on `nodes` intervals and its phases there, each with intervals by how long it lasts;
    without `even` in proportion to those it has, so that what the task asks at nodes stays at the
    same moments; see `meshed`."""
    t = plan.time
    lasts = [float(t[p.last] - t[p.first] if even else p.elements) for p in phases]
    found = meshed(phases, lasts, nodes, marks)
    if found is None:
        return None
    return _resampled(plan, phases, [p.elements for p in found]), found


def _resampled(plan: Trajectory, phases: Sequence[Phase], counts: Sequence[int]) -> Trajectory:
    """The plan at even steps in each phase. Rows of a phase are those after its first node: there
    velocities are from before an impact, inputs and forces those of the phase before."""
    clocks, columns = [plan.time[:1]], {h: [values[:1]] for h, values in plan.columns.items()}
    for phase, count in zip(phases, counts, strict=True):
        t, rows = plan.time, slice(phase.first + 1, phase.last + 1)
        clock = t[phase.first] + (t[phase.last] - t[phase.first]) * np.arange(1, count + 1) / count
        clock[-1] = t[phase.last]
        clocks.append(clock)
        for header, values in plan.columns.items():
            columns[header].append(np.interp(clock, t[rows], values[rows]))
    joined: dict[str, Array] = {header: np.concatenate(parts) for header, parts in columns.items()}
    return Trajectory(np.concatenate(clocks), joined, plan.meta)


ROUNDING = 1e-6  # of a tick, by which durations on their bounds are off


def edge_times(
    model: Model,
    reduction: Reduction,
    phases: Sequence[Phase],
    borders: np.ndarray,
    shortest: np.ndarray,
    longest: np.ndarray,
    dwell: float = 0.0,
) -> dict[int, float]:
    """When [s] phases that begin with a valve edge should begin, so that all edges are on ticks and
    the phases between two of them can last that long.

    `borders` (phases,): when they begin now; the first one stays at 0. `shortest`, `longest`
    (phases,): how long [s] they may last; `dwell` [s]: between two edges of a valve at least. Where
    edges of one moment have dead times that are no whole ticks apart, the first valve decides.
    """
    valves, edges, owners = _valves(model, reduction), [], []
    dead_times = [time for leg in model.mechanism.legs for time in model.timing(leg)]
    lead = float(ceil(max(dead_times) / PERIOD))  # commands come before what they do
    for j, (leg, force) in enumerate(valves):
        dead = model.timing(model.mechanism.legs[leg])
        before = 0.0
        own: list[tuple[int, float]] = []
        ticks: list[float] = []
        for p, phase in enumerate(phases):
            if phase.valves[j] != before:
                before = phase.valves[j]
                own.append((p, dead[0 if before else 1]))
                ticks.append(lead + (float(borders[p]) - own[-1][1]) / PERIOD)
        edges.append(ValveEdges(ticks, leg, force))
        owners.append(own)
    found: dict[int, float] = {}
    for own, chosen in zip(owners, rounded(edges), strict=True):
        for (p, late), tick in zip(own, chosen, strict=True):
            if p:
                found.setdefault(p, (tick - lead) * PERIOD + late)
    before, last = 0, 0.0
    switched: dict[int, float] = {}  # when each valve was
    for p, time in sorted(found.items()):
        least, most = (last + each[before:p].sum() for each in (shortest, longest))
        turned = [j for j, u in enumerate(phases[p].valves) if u != phases[p - 1].valves[j]]
        least = max([least, *(switched[j] + dwell for j in turned if j in switched)])
        later = ceil(max(0.0, least - time) / PERIOD - ROUNDING)
        sooner = ceil(max(0.0, time - most) / PERIOD - ROUNDING)
        before, last = p, time + (later - sooner) * PERIOD
        found[p] = last
        switched |= dict.fromkeys(turned, last)
    return dict(sorted(found.items()))


def _valves(model: Model, reduction: Reduction) -> list[tuple[int, float]]:
    """The leg that each valve of a phase drives, and which way it pushes."""
    keys = [key for key, q in model.inputs.items() if q.binary]
    places = [i for i, q in enumerate(model.inputs.values()) if q.binary]
    B, legs = reduction.B["u"][places], list(model.mechanism.legs)
    firsts = [int(np.flatnonzero(B[:, j])[0]) for j in range(B.shape[1]) if B[:, j].any()]
    return [(legs.index(str(keys[i][0])), 1.0 if keys[i][1] == "u_e" else -1.0) for i in firsts]


def on_ticks(program: PhaseProgram, x: np.ndarray) -> None:
    """Add the rows that keep the valve edges of a program on ticks, rounded from those of x
    (size,)."""
    h, phases = program.columns.h[:, 0], program.phases
    elements = np.array([phase.elements for phase in phases])
    lasts, shortest, longest = (elements * at[h] * STEP for at in (x, program.lower, program.upper))
    borders = np.concatenate([[0.0], np.cumsum(lasts)[:-1]])
    known = program.model, program.reduction, phases, borders
    times = edge_times(*known, shortest, longest, program.task.min_dwell)
    for p, time in times.items():
        z = ca.SX.sym("h", p)
        begins = ca.dot(z, ca.DM([phase.elements for phase in phases[:p]]))
        program.add("valve edge", z, begins, time / STEP, time / STEP, [h[:p]])
