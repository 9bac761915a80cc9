"""The multi-phase program: smooth, with phase durations free and every mode fixed; where
its variables are."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np

from kemba.model import Model
from kemba.ocp.functions.blocks import BlockProblem, RowBlock, block_problem
from kemba.ocp.phases.modes import OPEN, Phase
from kemba.ocp.phases.radau import STATE, Scheme, element, impact, node_vector, scaled, width
from kemba.ocp.phases.settings import Elements
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.task import Task
from kemba.ocp.transcription.layout import Layout
from kemba.ocp.transcription.symmetry import Reduction
from kemba.ocp.transcription.unilateral import Constraint


class Columns:
    """Indices of everything in the vector x of a multi-phase program.

    `first`: state at the start, by group; `stages[e][i]`: state and forces at stage i of element e;
    `drift` (elements, constraints): of closed gaps; `u` (elements, nu): inputs; `h` (phases, 1):
    element durations; `after`, `impulse`: velocities after and impulses at the impact that begins a
    phase.
    """

    def __init__(
        self, layout: Layout, phases: Sequence[Phase], impacts: Sequence[int], stages: int
    ) -> None:
        self.size = 0
        elements = phases[-1].last
        binary = [c - layout.slices["u"].start for c in layout.binary]
        n = {group: width(layout, group) for group in layout.slices}
        self.first = {g: self._new(n[g]) for g in STATE}
        stage_groups = (*STATE, "lam")
        self.stages = [
            [{g: self._new(n[g]) for g in stage_groups} for _ in range(stages)]
            for _ in range(elements)
        ]
        smooth = [i for i in range(n["u"]) if i not in binary]
        self.drift = self.more(elements, len(phases[0].modes))
        self.u = np.empty((elements, n["u"]), dtype=int)
        self.h = np.empty((len(phases), 1), dtype=int)
        for p, phase in enumerate(phases):
            self.u[phase.first : phase.last, binary] = self._new(len(binary))
            self.h[p] = self._new(1)
        for e in range(elements):
            self.u[e, smooth] = self._new(len(smooth))
        self.after = {p: self._new(n["v"]) for p in impacts}
        self.impulse = {p: self._new(n["lam"]) for p in impacts}
        self.phase_of = [p for p, phase in enumerate(phases) for _ in range(phase.elements)]
        self.starts = {phase.first: p for p, phase in enumerate(phases)}

        self.phases = list(phases)

    def _new(self, count: int) -> np.ndarray:
        self.size += count
        return np.arange(self.size - count, self.size)

    def nodes(self) -> np.ndarray:
        """The node that every column belongs to (size,); 0 for what phases share."""
        found = np.zeros(self.size, dtype=int)
        for e, stages in enumerate(self.stages):
            for stage in stages:
                for index in stage.values():
                    found[index] = e + 1
            found[self.drift[e]] = e + 1
        for p, index in self.after.items():
            found[index] = found[self.impulse[p]] = self.phases[p].first
        return found

    def more(self, repeats: int, count: int) -> np.ndarray:
        """New columns (repeats, count) behind all others."""
        return self._new(repeats * count).reshape(repeats, count)

    def end(self, node: int) -> dict[str, np.ndarray]:
        """Columns by group, each (width,), of q, v, s at a node, before its impact."""
        return self.first if node == 0 else self.stages[node - 1][-1]

    def begin(self, e: int) -> dict[str, np.ndarray]:
        """Columns by group, each (width,), of q, v, s at the start of element `e`, after an
        impact."""
        before, p = self.end(e), self.starts.get(e, -1)
        return {**before, "v": self.after[p]} if p in self.after else before

    def element(self, e: int) -> np.ndarray:
        """Columns (n,) of the variables z of element `e`."""
        start = self.begin(e)
        parts = [start[g] for g in STATE]
        parts += [stage[g] for stage in self.stages[e] for g in (*STATE, "lam")]
        return np.concatenate([*parts, self.drift[e], self.u[e], self.h[self.phase_of[e]]])


INF = np.inf
Where = list[tuple[int, np.ndarray]]  # phases and the columns of z there


@dataclass(frozen=True)
class Soft:
    """A mode constraint that may be violated.

    `constraint`: the index of its unilateral constraint; `kind`: what it asks (gap, slip, ...);
    `elements` (repeats,): where it holds, for a moment the one after it; `above`, `below`
    (repeats,) or None: columns of the slacks by which it leaves its upper and its lower bound.
    """

    constraint: int
    kind: str
    elements: np.ndarray
    above: np.ndarray | None
    below: np.ndarray | None


@dataclass(frozen=True)
class PhasePart:
    """Rows g and cost f of z between bounds, and where they hold (repeats, len(z))."""

    labels: tuple[str, ...]
    z: ca.SX
    g: ca.SX
    f: ca.SX
    lower: float
    upper: float
    columns: np.ndarray
    soft: Soft | None = None


class PhaseRow(NamedTuple):
    """One row of the program: its meaning, the node it is about, its bounds."""

    label: str
    node: int
    lower: float
    upper: float


class PhaseProgram:
    """The program of a phase sequence.

    `lower`, `upper` (size,) bound the variables x, `columns` says where each is; `g_lower`,
    `g_upper` (rows,) bound the rows, `rows` says what each means. `elastic`: 0 where modes hold
    exactly, else the price of a mode constraint that is violated by its scale.
    """

    def __init__(
        self,
        model: Model,
        task: Task,
        reduction: Reduction,
        phases: Sequence[Phase],
        constraints: Sequence[Constraint],
        scheme: Scheme,
        elastic: float = 0.0,
    ) -> None:
        self.scheme, self.elastic = scheme, elastic
        self.model, self.task, self.reduction = model, task, reduction
        self.phases, self.constraints = list(phases), list(constraints)
        self.nodes = phases[-1].last
        self.layout = Layout(model, reduction, task.duration / self.nodes, task.step_variation)
        self.impacts = [
            p
            for p in range(1, len(phases))
            if any(self.closes(p, i) for i in range(len(self.constraints)))
        ]
        self.columns = Columns(self.layout, phases, self.impacts, scheme.stages)
        self.lower, self.upper = self._bounds()
        gaps = [constraint.gap for constraint in constraints]
        self.element = element(model, self.layout, reduction, task.cost, scheme, gaps)
        self.jump = impact(model, self.layout, reduction)
        self.added: list[PhasePart] = []
        self.requirements: Sequence[Requirement] = ()
        self.landing: list[int] = []  # the nodes at which impacts are those of a landing

    def closes(self, p: int, i: int) -> bool:
        """Whether constraint i was open before phase p and is closed in it."""
        return p > 0 and self.phases[p - 1].modes[i] == OPEN != self.phases[p].modes[i]

    def _bounds(self) -> tuple[np.ndarray, np.ndarray]:
        layout, c = self.layout, self.columns
        lower, upper = np.full(c.size, -INF), np.full(c.size, INF)

        def put(index: np.ndarray, group: str) -> None:
            part = layout.slices[group]
            lower[index], upper[index] = layout.lower[part], layout.upper[part]

        for g in STATE:
            put(c.first[g], g)
        states = layout.slices["s"]
        vented = layout.lower[states] - Elements.vented * layout.upper[states]
        for e, stages in enumerate(c.stages):
            for stage in stages:
                for g in STATE:
                    put(stage[g], g)
                lower[stage["s"]] = vented
                self._forces(lower, upper, stage["lam"], self.phases[c.phase_of[e]].modes)
            put(c.u[e], "u")
            is_open = [not self.phases[c.phase_of[e]].active(i) for i in range(c.drift.shape[1])]
            lower[c.drift[e, is_open]] = upper[c.drift[e, is_open]] = 0.0
        nominal = self.task.duration / self.nodes / layout.scale[layout.slices["h"]]
        lower[c.h[:, 0]] = Elements.shortest * nominal
        upper[c.h[:, 0]] = Elements.longest * nominal
        for phase in self.phases:
            where = c.u[phase.first][[i - layout.slices["u"].start for i in layout.binary]]
            lower[where] = upper[where] = phase.valves
        for p in self.impacts:
            put(c.after[p], "v")
            self._forces(lower, upper, c.impulse[p], self.phases[p].modes)
        return lower, upper

    def _forces(
        self, lower: np.ndarray, upper: np.ndarray, index: np.ndarray, modes: Sequence[int]
    ) -> None:
        """Forces are zero while open; while closed, friction is one signed force."""
        top = self.layout.upper[self.layout.slices["lam"]]
        lower[index] = upper[index] = 0.0
        for constraint, mode in zip(self.constraints, modes, strict=True):
            if mode == OPEN:
                continue
            j = self.place(constraint.force)
            upper[index[j]] = top[j]
            if constraint.friction is not None:
                j = self.place(constraint.friction.forward)
                lower[index[j]], upper[index[j]] = -top[j], top[j]

    def place(self, force: int) -> int:
        """Column of a force of the whole robot among the half's."""
        return int(np.flatnonzero(self.reduction.B["lam"][force])[0])

    @property
    def frictions(self) -> list[tuple[int, int]]:
        """Columns of every contact's forward and backward friction in rows of scaled variables."""
        first = self.layout.slices["lam"].start
        pairs = [(c.friction.forward, c.friction.backward) for c in self.constraints if c.friction]
        return [(first + self.place(a), first + self.place(b)) for a, b in pairs]

    def add(
        self, label: str, z: ca.SX, g: ca.SX, low: float, high: float, columns: list[np.ndarray]
    ) -> None:
        """Add the row low <= g(z) <= high, once for each z in `columns` (repeats, len(z))."""
        if columns:
            part = PhasePart((label,), z, ca.SX(g), ca.SX(0), low, high, np.array(columns))
            self.reset([*self.added, part])

    def reset(self, added: list[PhasePart]) -> None:
        """The program with these rows and costs beside those of the physics."""
        self.added = added
        for made in ("problem", "parts", "rows", "g_lower", "g_upper"):
            self.__dict__.pop(made, None)

    def add_cost(self, z: ca.SX, f: ca.SX, columns: np.ndarray) -> None:
        """Add the cost f(z), whose z is at `columns` (len(z),)."""
        part = PhasePart((), z, ca.SX(0, 1), f, 0.0, 0.0, columns[None, :])
        self.added.append(part)

    def mode_constraint(
        self, i: int, kind: str, z: ca.SX, g: ca.SX, low: float, high: float, where: Where
    ) -> None:
        """Add rows low <= g <= high for a mode of constraint `i`.

        `z` (n,), `g` scalar: expressions; `where`: the phase and the columns (n,) of each repeat.
        In an elastic program a row may be violated at a price.
        """
        label, columns = f"{self.constraints[i].label} {kind}", [at for _, at in where]
        if not self.elastic or not columns:
            self.add(label, z, g, low, high, columns)
            return
        slack = ca.SX.sym("slack", int(high < INF) + int(low > -INF))
        own = self.columns.more(len(columns), slack.numel())
        self.lower = np.concatenate([self.lower, np.zeros(own.size)])
        self.upper = np.concatenate([self.upper, np.full(own.size, INF)])
        above, below = (
            own[:, j] if used else None for j, used in ((0, high < INF), (-1, low > -INF))
        )
        g = g - slack[0] * float(high < INF) + slack[-1] * float(low > -INF)
        nodes = self.columns.nodes()
        spans = [(self.phases[p].first, self.phases[p].last - 1) for p, _ in where]
        ends = [nodes[index].max() - 1 for index in columns]
        elements = np.array([np.clip(e, *span) for e, span in zip(ends, spans, strict=True)])
        soft = Soft(i, kind, elements, above, below)
        at, price = np.hstack([np.array(columns), own]), self.elastic * ca.sum1(slack)
        self.added.append(PhasePart((label,), ca.vertcat(z, slack), g, price, low, high, at, soft))

    def proximal(self, x: np.ndarray, weight: float) -> np.ndarray:
        """Add weight / 2 times the squared scaled distance of states, inputs and durations from
        where they are in x (size,); returns x with these places as fixed variables behind it."""
        c = self.columns
        stages = [stage for element in c.stages for stage in element]
        drawn = [at[g] for at in (c.first, *stages) for g in STATE]
        index = np.concatenate([*drawn, np.unique(c.u), c.h.ravel()])
        index = index[self.lower[index] < self.upper[index]]
        fixed = c.more(len(index), 1)
        self.lower = np.concatenate([self.lower, x[index]])
        self.upper = np.concatenate([self.upper, x[index]])
        z, nothing = ca.SX.sym("z", 2), ca.SX(0, 1)
        pull, at = weight / 2 * (z[0] - z[1]) ** 2, np.column_stack([index, fixed])
        self.added.append(PhasePart((), z, nothing, pull, 0.0, 0.0, at))
        return np.concatenate([x, x[index]])

    @property
    def soft(self) -> list[Soft]:
        """The mode constraints that may be violated."""
        return [part.soft for part in self.added if part.soft is not None]

    def loosened(self, x: np.ndarray) -> np.ndarray:
        """x (size,) with slacks a little larger than every mode constraint needs there."""
        x, row = x.copy(), 0
        g = np.array(self.problem.g(x, [])).ravel()
        for part in self.parts:
            values = g[row : row + len(part.columns) * len(part.labels)]
            row += len(values)
            if part.soft is None:
                continue
            for way, over in (
                (part.soft.above, values - part.upper),
                (part.soft.below, part.lower - values),
            ):
                if way is not None:
                    x[way] = np.maximum(over, 0.0) + Elements.leeway
        return x

    @cached_property
    def problem(self) -> BlockProblem:
        """The functions for IPOPT."""
        blocks = [RowBlock(part.z, part.g, part.f, part.columns) for part in self.parts]
        return block_problem(blocks, self.columns.size, ca.SX(0, 1), shared=True)

    @cached_property
    def parts(self) -> list[PhasePart]:
        """What the program consists of, in the order of its rows."""
        c, hits = self.columns, []
        for p in self.impacts:
            before = c.end(self.phases[p].first)
            hits.append(np.concatenate([*(before[g] for g in STATE), c.after[p], c.impulse[p]]))
        physics = (self.element, [c.element(e) for e in range(self.nodes)]), (self.jump, hits)
        found = [
            PhasePart(rows.labels, rows.z, rows.g, rows.f, 0.0, 0.0, np.array(columns))
            for rows, columns in physics
            if columns
        ]
        return found + self.added

    @cached_property
    def rows(self) -> list[PhaseRow]:
        """What every row means and where it holds."""
        nodes = self.columns.nodes()
        return [
            PhaseRow(label, node, part.lower, part.upper)
            for part in self.parts
            for node in nodes[part.columns].max(axis=1).tolist()
            for label in part.labels
        ]

    @cached_property
    def g_lower(self) -> np.ndarray:
        """Lower bounds (rows,) of the rows."""
        return np.array([row.lower for row in self.rows])

    @cached_property
    def g_upper(self) -> np.ndarray:
        """Upper bounds (rows,) of the rows."""
        return np.array([row.upper for row in self.rows])


class View:
    """The node's expressions as functions of scaled half symbols q, v, s, u, lam."""

    def __init__(self, program: PhaseProgram) -> None:
        self.layout = program.layout
        self.symbols = {g: scaled(self.layout, g, g) for g in ("q", "v", "s", "u", "lam")}
        self.of = self.layout.reader(program.model.node, node_vector(self.layout, self.symbols))

    def z(self, groups: str) -> ca.SX:
        """The symbols of some groups as one vector; `groups` such as "q v"."""
        return ca.vertcat(*(self.symbols[g] for g in groups.split()))
