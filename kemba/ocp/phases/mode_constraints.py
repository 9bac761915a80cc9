"""Mode constraints: closed gaps stay zero, open ones positive, friction stays in its cone."""

import itertools

import casadi as ca
import numpy as np

from kemba.mechanism.knee import felt
from kemba.ocp.phases.independent import Independent
from kemba.ocp.phases.modes import AHEAD, BACK, HELD, OPEN
from kemba.ocp.phases.program import PhaseProgram, View, Where
from kemba.ocp.phases.radau import STATE
from kemba.ocp.phases.settings import ModeConstraints
from kemba.ocp.task.requirement import SCALES
from kemba.ocp.transcription.first_node import state_rows
from kemba.ocp.transcription.unilateral import Constraint, Friction

INF = np.inf
LENGTH, SPEED = SCALES["m"], SCALES["m.s-1"]  # of gaps and their rates


def add_mode_constraints(program: PhaseProgram, start: Independent) -> None:
    """Add the rows of every mode in every phase and at every impact.

    `start`: the equalities that the task already asks for at the first node.
    """
    view = View(program)
    for i, constraint in enumerate(program.constraints):
        _gaps(program, view, i, constraint)
        _held(program, view, i, constraint)
        _friction(program, view, i, constraint)
        _start(program, view, i, constraint, start)
    _first_state(program, view, start)
    _limits(program, view)
    _durations(program)


def _gaps(program: PhaseProgram, view: View, i: int, constraint: Constraint) -> None:
    """Open gaps stay positive; where one closes it is zero, and a foot moves downwards."""
    c, phases = program.columns, program.phases
    closing = {phases[p].first: p for p in program.impacts if program.closes(p, i)}
    closed = np.array([phases[p].active(i) for p in c.phase_of])
    near = max(ModeConstraints.away, round(ModeConstraints.away_share * program.nodes))
    away = np.convolve(closed, np.ones(2 * near + 1), "same") < 1  # of a closed element
    g = view.of(constraint.gap) / LENGTH
    for clear in (False, True):
        apart: Where = [
            (c.phase_of[e], stage["q"])
            for e in np.flatnonzero(~closed & (away == clear))
            for stage in (c.stages[e][:-1] if e + 1 in closing else c.stages[e])
        ]
        low = ModeConstraints.clear / LENGTH if clear else 0.0
        program.mode_constraint(i, "gap", view.z("q"), g, low, INF, apart)
    touching = [(closing[node], c.end(node)["q"]) for node in sorted(closing)]
    rate = view.of(constraint.rate) / SPEED
    hits = {n: (p, np.concatenate([c.end(n)["q"], c.end(n)["v"]])) for n, p in closing.items()}
    soft = program.task.landing.impact_speed
    if soft is not None:
        late = [at for node, at in hits.items() if node > program.apex]
        own = felt(program.model.mechanism, constraint.label)
        program.mode_constraint(i, "lands", view.z("q v"), own * rate, -soft / SPEED, INF, late)
    program.mode_constraint(i, "touch", view.z("q"), g, 0.0, 0.0, touching)
    if constraint.friction is not None:
        least = ModeConstraints.lands if soft is None else min(ModeConstraints.lands, soft / 2)
        low = -least / SPEED
        program.mode_constraint(i, "approach", view.z("q v"), rate, -INF, low, list(hits.values()))


def _held(program: PhaseProgram, view: View, i: int, constraint: Constraint) -> None:
    """The rate of a closed gap is zero, and the slip of a sticking contact."""
    c, phases = program.columns, program.phases
    rate = view.of(constraint.rate) / SPEED
    states: Where = [
        (c.phase_of[e], np.concatenate([stage["q"], stage["v"]]))
        for e in range(program.nodes)
        for stage in c.stages[e]
    ]
    states += [(p, np.concatenate([c.end(phases[p].first)["q"], c.after[p]])) for p in c.after]
    closed = [(p, z) for p, z in states if phases[p].active(i)]
    program.mode_constraint(i, "rate", view.z("q v"), rate, 0.0, 0.0, closed)
    if constraint.friction is None:
        return
    slip = view.of(constraint.friction.slip) / SPEED
    settling = [
        (p, np.concatenate([c.end(phases[p].first)["q"], c.end(phases[p].first)["v"]]))
        for p in range(1, len(phases))
        if phases[p].modes[i] == HELD and phases[p - 1].modes[i] in (AHEAD, BACK)
        and p not in c.after
    ]  # fmt: skip
    sets = [(HELD, 0.0, 0.0), (AHEAD, 0.0, INF), (BACK, -INF, 0.0)]
    settled = {tuple(z) for _, z in settling}
    for wanted, low, high in sets:
        own = [(p, z) for p, z in states if phases[p].modes[i] == wanted]
        where = [(p, z) for p, z in own if tuple(z) not in settled]
        program.mode_constraint(i, "slip", view.z("q v"), slip, low, high, where)
    program.mode_constraint(i, "settles", view.z("q v"), slip, 0.0, 0.0, settling)


def _friction(program: PhaseProgram, view: View, i: int, constraint: Constraint) -> None:
    """Forces and impulses in the cone, that of the task's `grip` while sticking; on its edge while
    sliding. A plan in a narrower cone is the same motion on any ground that has this much friction.
    """
    if constraint.friction is None:
        return
    c, phases = program.columns, program.phases
    somewhere = ca.depends_on(constraint.friction.cone_forward, program.model.node.q)
    own = "q lam" if somewhere else "lam"  # where friction differs from place to place
    stages = [(c.phase_of[e], stage) for e in range(program.nodes) for stage in c.stages[e]]
    hits = [
        (p, {"q": c.end(phases[p].first)["q"], "lam": impulse}) for p, impulse in c.impulse.items()
    ]
    forces: Where = [
        (p, np.concatenate([at[g] for g in own.split()])) for p, at in (*stages, *hits)
    ]
    weight = program.model.mechanism.weight
    edges = (("forward", constraint.friction.cone_forward, BACK),
             ("backward", constraint.friction.cone_backward, AHEAD))  # fmt: skip
    for way, cone, sliding in edges:
        most = ca.substitute(cone, _tangential(program, constraint.friction), ca.SX.zeros(2))
        held = view.of(cone - (1.0 - program.task.grip) * most) / weight
        for wanted, g, high in ((HELD, held, INF), (sliding, view.of(cone) / weight, 0.0)):
            where = [(p, lam) for p, lam in forces if phases[p].modes[i] == wanted]
            program.mode_constraint(i, f"cone {way}", view.z(own), g, 0.0, high, where)


def _tangential(program: PhaseProgram, friction: Friction) -> ca.SX:
    """Both parts (2,) of a contact's friction among the forces of the node."""
    lam = program.model.node.lam
    return ca.vertcat(lam[friction.forward], lam[friction.backward])


def _start(
    program: PhaseProgram, view: View, i: int, constraint: Constraint, start: Independent
) -> None:
    """Gap and rate of a constraint that is closed at first are zero; not where the task says so."""
    mode, first = program.phases[0].modes[i], program.columns.first
    if mode == OPEN:
        return
    at = np.concatenate([first["q"], first["v"]])
    rows = [("gap", constraint.gap, LENGTH), ("rate", constraint.rate, SPEED)]
    if constraint.friction is not None and mode == HELD:
        rows.append(("slip", constraint.friction.slip, SPEED))
    for name, expression, scale in rows:
        g = view.of(expression) / scale
        if start.adds(g, view, f"that {constraint.label} is closed at first"):
            program.add(f"{constraint.label} first {name}", view.z("q v"), g, 0.0, 0.0, [at])


def _first_state(program: PhaseProgram, view: View, start: Independent) -> None:
    """What holds in every state, at the first node; not where equalities there decide it."""
    node, reduction, first = program.model.node, program.reduction, program.columns.first
    at = np.concatenate([first[g] for g in STATE])
    for row in state_rows(node, reduction.pairs, reduction.limits):
        g = view.of(row.expression) / (LENGTH if row.unit == "m" else row.scale)
        if not start.grants(g, view):
            program.add(f"{row.label} first", view.z("q v s"), g, 0.0, INF, [at])


def _limits(program: PhaseProgram, view: View) -> None:
    c = program.columns
    for j in program.reduction.limits:
        label = program.model.node.limit_rows[j].label
        where = [
            np.concatenate([stage["q"], stage["v"], stage["s"], c.u[e], stage["lam"]])
            for e in range(program.nodes)
            for stage in c.stages[e]
        ]
        g = view.of(program.model.node.limits[j])
        program.add(label, view.z("q v s u lam"), g, 0.0, INF, where)


def _durations(program: PhaseProgram) -> None:
    """The whole motion lasts what the task allows, and valves dwell between switches."""
    task, phases, h = program.task, program.phases, ca.SX.sym("h", len(program.phases))
    scale = program.layout.scale[program.layout.slices["h"]][0]
    lasting = [phase.elements * scale * h[p] / task.duration for p, phase in enumerate(phases)]
    columns = [program.columns.h[:, 0]]
    low, high = 1 - task.step_variation, 1 + task.step_variation
    program.add("duration", h, sum(lasting), low, high, columns)
    for valve in range(len(phases[0].valves)):
        places = [phase.valves[valve] for phase in phases]
        switches = [p for p in range(1, len(phases)) if places[p] != places[p - 1]]
        for a, b in itertools.pairwise(switches):
            dwell = sum(lasting[a:b], ca.SX(0))
            program.add("dwell", h, dwell, task.min_dwell / task.duration, INF, columns)
