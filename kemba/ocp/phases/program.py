"""The multi-phase program: smooth, with phase durations free and every mode fixed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from kemba.model import Model
from kemba.ocp.blocks import Block, BlockProblem
from kemba.ocp.layout import Layout
from kemba.ocp.mirror import Reduction
from kemba.ocp.phases.constraints import Constraint
from kemba.ocp.phases.modes import OPEN, Phase
from kemba.ocp.phases.radau import STATE, Scheme, element, impact, width
from kemba.ocp.task import Task

INF = np.inf
SLACK = 0.01  # of a state's range: a vented chamber stays exactly at its bound
SHORT, LONG = 0.03, 2.5  # times the nominal step: bounds of an element


class Columns:
    """Where everything stands in the vector: indices by group, for nodes, stages and phases."""

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
        return found

    def end(self, node: int) -> dict[str, np.ndarray]:
        """q, v, s at a node, before its impact."""
        return self.first if node == 0 else self.stages[node - 1][-1]

    def begin(self, e: int) -> dict[str, np.ndarray]:
        """q, v, s at the start of element e, after an impact."""
        before, p = self.end(e), self.starts.get(e, -1)
        return {**before, "v": self.after[p]} if p in self.after else before

    def element(self, e: int) -> np.ndarray:
        """Columns of an element's z."""
        start = self.begin(e)
        parts = [start[g] for g in STATE]
        parts += [stage[g] for stage in self.stages[e] for g in (*STATE, "lam")]
        return np.concatenate([*parts, self.u[e], self.h[self.phase_of[e]]])


@dataclass(frozen=True)
class Part:
    """Rows g and cost f of z between bounds, and where they hold (repeats, len(z))."""

    labels: tuple[str, ...]
    z: ca.SX
    g: ca.SX
    f: ca.SX
    lower: float
    upper: float
    columns: np.ndarray


@dataclass(frozen=True)
class Row:
    """One row of the program: its meaning, the node it is about, its bounds."""

    label: str
    node: int
    lower: float
    upper: float


class Program:
    """The program of a phase sequence; `lower`, `upper`, `g_lower`, `g_upper` and `problem` as a
    Transcription has them."""

    def __init__(
        self,
        model: Model,
        task: Task,
        reduction: Reduction,
        phases: Sequence[Phase],
        constraints: Sequence[Constraint],
        scheme: Scheme,
    ) -> None:
        self.scheme = scheme
        self.model, self.task, self.reduction = model, task, reduction
        self.phases, self.constraints = list(phases), list(constraints)
        self.nodes = phases[-1].last
        self.layout = Layout(model, reduction, task.duration / self.nodes, task.step_variation)
        self.impacts = [p for p in range(1, len(phases)) if self._closes(p)]
        self.columns = Columns(self.layout, phases, self.impacts, scheme.stages)
        self.shape = (self.columns.size,)
        self.lower, self.upper = self._bounds()
        self.element = element(model, self.layout, reduction, task.cost, scheme)
        self.jump = impact(model, self.layout, reduction)
        self.rules: list[Part] = []

    def _closes(self, p: int) -> bool:
        """Whether a constraint that was open is closed from phase p on."""
        return any(self.closes(p, i) for i in range(len(self.constraints)))

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
        vented = layout.lower[layout.slices["s"]] - SLACK * layout.upper[layout.slices["s"]]
        for e, stages in enumerate(c.stages):
            for stage in stages:
                for g in STATE:
                    put(stage[g], g)
                lower[stage["s"]] = vented
                self._forces(lower, upper, stage["lam"], self.phases[c.phase_of[e]].modes)
            put(c.u[e], "u")
        nominal = self.task.duration / self.nodes / layout.scale[layout.slices["h"]]
        lower[c.h[:, 0]], upper[c.h[:, 0]] = SHORT * nominal, LONG * nominal
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
        """Forces are zero where open; friction is one signed force while closed."""
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

    def rule(
        self, label: str, z: ca.SX, g: ca.SX, low: float, high: float, columns: list[np.ndarray]
    ) -> None:
        """Add a row wherever `columns` say."""
        if columns:
            part = Part((label,), z, ca.SX(g), ca.SX(0), low, high, np.array(columns))
            self.rules.append(part)

    @cached_property
    def problem(self) -> BlockProblem:
        """The functions for IPOPT."""
        blocks = [Block(part.z, part.g, part.f, part.columns) for part in self._parts]
        return BlockProblem(blocks, self.columns.size, ca.SX(0, 1))

    @cached_property
    def _parts(self) -> list[Part]:
        c, zero = self.columns, ca.SX(0)
        every = np.array([c.element(e) for e in range(self.nodes)])
        body = self.element
        found = [Part(body.labels, body.z, body.g, body.f, 0.0, 0.0, every)]
        hits = []
        for p in self.impacts:
            before = c.end(self.phases[p].first)
            hits.append(np.concatenate([*(before[g] for g in STATE), c.after[p], c.impulse[p]]))
        if hits:
            jump = self.jump
            found.append(Part(jump.labels, jump.z, jump.g, zero, 0.0, 0.0, np.array(hits)))
        return found + self.rules

    @cached_property
    def rows(self) -> list[Row]:
        """What every row means and where it holds."""
        nodes = self.columns.nodes()
        return [
            Row(label, int(nodes[columns].max()), part.lower, part.upper)
            for part in self._parts
            for columns in part.columns
            for label in part.labels
        ]

    @property
    def g_lower(self) -> np.ndarray:
        return np.array([row.lower for row in self.rows])

    @property
    def g_upper(self) -> np.ndarray:
        return np.array([row.upper for row in self.rows])
