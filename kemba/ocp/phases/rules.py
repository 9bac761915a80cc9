"""What every mode asks: closed constraints hold, open ones stay apart, friction in its cone."""

from __future__ import annotations

import itertools

import casadi as ca
import numpy as np

from kemba.ocp.phases.constraints import Constraint
from kemba.ocp.phases.independent import Independent
from kemba.ocp.phases.modes import AHEAD, BACK, HELD, OPEN
from kemba.ocp.phases.program import Program
from kemba.ocp.phases.radau import node_vector, scaled

INF = np.inf
LENGTH, SPEED = 0.1, 1.0  # m, m.s-1: scales of gaps and their rates


class View:
    """Expressions of the node in half symbols: `q`, `v`, `s`, `u`, `lam` scaled."""

    def __init__(self, program: Program) -> None:
        self.layout, self.node = program.layout, program.model.node
        groups = ("q", "v", "s", "u", "lam")
        self.symbols = {g: scaled(self.layout, g, g) for g in groups}
        y = node_vector(self.layout, self.symbols)
        self._full = [ca.densify(self.layout.full(y, g)) for g in groups]

    def of(self, expression: ca.SX) -> ca.SX:
        """An expression of the node's symbols in the half ones."""
        node = self.node
        symbols = [node.q, node.v, node.s, node.u, node.lam]
        return ca.SX(ca.cse(ca.densify(ca.substitute([ca.SX(expression)], symbols, self._full)[0])))

    def z(self, groups: str) -> ca.SX:
        """The symbols of some groups, such as "q v"."""
        return ca.vertcat(*(self.symbols[g] for g in groups.split()))


def add_rules(program: Program, start: Independent) -> None:
    """Rows of every constraint in every phase and at every impact; `start` knows what the task
    already fixes at the first node."""
    view = View(program)
    for i, constraint in enumerate(program.constraints):
        _gaps(program, view, i, constraint)
        _held(program, view, i, constraint)
        _friction(program, view, i, constraint)
        _start(program, view, i, constraint, start)
    _limits(program, view)
    _durations(program)


def _gaps(program: Program, view: View, i: int, constraint: Constraint) -> None:
    """Open gaps stay open; where one closes it is zero."""
    c, phases = program.columns, program.phases
    closing = {phases[p].first for p in program.impacts if program.closes(p, i)}
    apart = [
        c.stages[e][stage]["q"]
        for e in range(program.nodes)
        for stage in range(len(c.stages[e]))
        if not phases[c.phase_of[e]].active(i) and not (stage and e + 1 in closing)
    ]
    g = view.of(constraint.gap) / LENGTH
    program.rule(f"{constraint.label} gap", view.z("q"), g, 0.0, INF, apart)
    touching = [c.end(node)["q"] for node in sorted(closing)]
    program.rule(f"{constraint.label} touch", view.z("q"), g, 0.0, 0.0, touching)


def _held(program: Program, view: View, i: int, constraint: Constraint) -> None:
    """The rate of a closed gap is zero, and the slip of a sticking contact."""
    c, phases = program.columns, program.phases
    rate = view.of(constraint.rate) / SPEED
    states = [
        (phases[c.phase_of[e]].modes[i], np.concatenate([stage["q"], stage["v"]]))
        for e in range(program.nodes)
        for stage in c.stages[e]
    ]
    states += [
        (phases[p].modes[i], np.concatenate([c.end(phases[p].first)["q"], c.after[p]]))
        for p in program.impacts
    ]
    closed = [z for mode, z in states if mode != OPEN]
    program.rule(f"{constraint.label} rate", view.z("q v"), rate, 0.0, 0.0, closed)
    if constraint.friction is None:
        return
    slip = view.of(constraint.friction.slip) / SPEED
    settling = [
        np.concatenate([c.end(phases[p].first)["q"], c.end(phases[p].first)["v"]])
        for p in range(1, len(phases))
        if phases[p].modes[i] == HELD and phases[p - 1].modes[i] in (AHEAD, BACK)
        and p not in c.after
    ]  # fmt: skip
    sets = [(HELD, 0.0, 0.0), (AHEAD, 0.0, INF), (BACK, -INF, 0.0)]
    for wanted, low, high in sets:
        where = [z for mode, z in states if mode == wanted]
        program.rule(f"{constraint.label} slip", view.z("q v"), slip, low, high, where)
    program.rule(f"{constraint.label} settles", view.z("q v"), slip, 0.0, 0.0, settling)


def _friction(program: Program, view: View, i: int, constraint: Constraint) -> None:
    """Forces and impulses in the cone; on its edge while sliding."""
    if constraint.friction is None:
        return
    c, phases = program.columns, program.phases
    forces = [
        (phases[c.phase_of[e]].modes[i], stage["lam"])
        for e in range(program.nodes)
        for stage in c.stages[e]
    ]
    forces += [(phases[p].modes[i], c.impulse[p]) for p in program.impacts]
    weight = program.model.mechanism.weight
    edges = ((constraint.friction.cone_forward, BACK), (constraint.friction.cone_backward, AHEAD))
    for cone, sliding in edges:
        g = view.of(cone) / weight
        for wanted, high in ((HELD, INF), (sliding, 0.0)):
            where = [lam for mode, lam in forces if mode == wanted]
            program.rule(f"{constraint.label} cone", view.z("lam"), g, 0.0, high, where)


def _start(
    program: Program, view: View, i: int, constraint: Constraint, start: Independent
) -> None:
    """A constraint that is closed at first touches at rest there, unless the task says so."""
    mode, first = program.phases[0].modes[i], program.columns.first
    if mode == OPEN:
        return
    at = np.concatenate([first["q"], first["v"]])
    rows = [("gap", constraint.gap, LENGTH), ("rate", constraint.rate, SPEED)]
    if constraint.friction is not None and mode == HELD:
        rows.append(("slip", constraint.friction.slip, SPEED))
    for name, expression, scale in rows:
        g = view.of(expression) / scale
        if start.adds(g, view):
            program.rule(f"{constraint.label} first {name}", view.z("q v"), g, 0.0, 0.0, [at])


def _limits(program: Program, view: View) -> None:
    c = program.columns
    for j in program.reduction.limits:
        label = program.model.node.limit_rows[j].label
        where = [
            np.concatenate([stage["q"], stage["v"], stage["s"], c.u[e], stage["lam"]])
            for e in range(program.nodes)
            for stage in c.stages[e]
        ]
        g = view.of(program.model.node.limits[j])
        program.rule(label, view.z("q v s u lam"), g, 0.0, INF, where)


def _durations(program: Program) -> None:
    """The whole motion lasts what the task allows, and valves dwell between switches."""
    task, phases, h = program.task, program.phases, ca.SX.sym("h", len(program.phases))
    scale = program.layout.scale[program.layout.slices["h"]][0]
    lasting = [phase.elements * scale * h[p] / task.duration for p, phase in enumerate(phases)]
    columns = [program.columns.h[:, 0]]
    low, high = 1 - task.step_variation, 1 + task.step_variation
    program.rule("duration", h, sum(lasting), low, high, columns)
    for valve in range(len(phases[0].valves)):
        places = [phase.valves[valve] for phase in phases]
        switches = [p for p in range(1, len(phases)) if places[p] != places[p - 1]]
        for a, b in itertools.pairwise(switches):
            dwell = sum(lasting[a:b], ca.SX(0))
            program.rule("dwell", h, dwell, task.min_dwell / task.duration, INF, columns)
