"""What modes and the task ask of the multi-phase program: closed gaps stay zero, open ones
positive, friction stays in its cone; requirements hold at element ends. Of the
equalities at one node only linearly independent ones are kept; the others must agree."""

import itertools
from collections.abc import Sequence

import casadi as ca
import numpy as np

from kemba.mechanism.knee import felt
from kemba.ocp.phases.modes import AHEAD, BACK, HELD, OPEN
from kemba.ocp.phases.program import PhaseProgram, View, Where
from kemba.ocp.phases.radau import STATE
from kemba.ocp.phases.settings import ModeConstraints
from kemba.ocp.task.requirement import SCALES, Requirement, landing_nodes, quantity_expression
from kemba.ocp.transcription.first_node import state_rows
from kemba.ocp.transcription.stage import aim_cost, as_variable, tighter_bounds
from kemba.ocp.transcription.unilateral import Constraint

AGREES = 1e-4  # of a scaled quantity; a dependent equality with another value contradicts the rest
STEPS = 10  # of Gauss and Newton to a point on the equalities


class ContradictionError(ValueError):
    """An equality that asks for another value than those from which it follows."""


class Independent:
    """Equalities at one node, by their gradients with respect to (q, v, s) at a guess.

    Dependent equalities would have no unique multipliers, so they are left out. Gradients are taken
    at the velocities at which the equalities hold: at others a rate that follows from further ones
    has a slope by the coordinates, and would pass for a condition on these.
    """

    def __init__(self, guess: dict[str, np.ndarray]) -> None:
        self.guess = np.concatenate([guess[x] for x in ("q", "v", "s")])
        self.velocities = slice(len(guess["q"]), len(guess["q"]) + len(guess["v"]))
        self.kept: list[ca.Function] = []

    def adds(self, g: ca.SX, view: View, what: str) -> bool:
        """Whether g = 0 (g is a scalar) is independent of the equalities so far; if so it joins
        them. Raises ContradictionError, which names `what` is asked, where these exclude it."""
        equality, there = _with_slope(g, view), self._where_all_hold()
        if not self._leaves(equality, self._moving(there)):
            if abs(float(equality(there)[0])) <= AGREES:
                return False
            # gradients may depend at one point alone: legs that stand right below their hips
            if not self._leaves(equality, there):
                raise ContradictionError(f"the order of contacts and stops excludes {what}")
        self.kept.append(equality)
        return True

    def grants(self, g: ca.SX, view: View) -> bool:
        """Whether the equalities so far decide a scalar g."""
        return not self._leaves(_with_slope(g, view), self._moving(self._where_all_hold()))

    def _moving(self, there: np.ndarray) -> np.ndarray:
        """The guess (n,) with the velocities of another point (n,)."""
        point: np.ndarray = self.guess.copy()
        point[self.velocities] = there[self.velocities]
        return point

    def _leaves(self, equality: ca.Function, at: np.ndarray) -> bool:
        """Whether the gradient at a point (n,) leaves the span of those of the equalities so
        far."""
        small, basis = ModeConstraints.independent, np.zeros((0, len(at)))
        for one in (*self.kept, equality):
            row = np.array(one(at)[1]).ravel()
            size = float(np.linalg.norm(row))
            for b in basis:
                row = row - (row @ b) * b
            left = float(np.linalg.norm(row))
            independent = left > small * max(size, small)
            if independent:
                basis = np.vstack([basis, row / left])
        return independent

    def _where_all_hold(self) -> np.ndarray:
        """The point (n,) near the guess at which all equalities so far hold."""
        x = self.guess
        for _ in range(STEPS if self.kept else 0):
            parts = [kept(x) for kept in self.kept]
            left = np.array([float(value) for value, _ in parts])
            if np.abs(left).max() < AGREES * AGREES:
                break
            slopes = np.vstack([np.array(slope) for _, slope in parts])
            x = x - np.linalg.lstsq(slopes, left, rcond=None)[0]
        return x


def _with_slope(g: ca.SX, view: View) -> ca.Function:
    """A scalar g and its gradient (1, n) as a function of (q, v, s)."""
    z = view.z("q v s")
    return ca.Function("equality", [z], [ca.densify(g), ca.densify(ca.jacobian(g, z))])


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
    beyond = np.pad(closed, near, constant_values=True)  # the ends, too: the task may have it touch
    away = np.convolve(beyond, np.ones(2 * near + 1), "valid") < 1  # of a closed element
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
        late = [at for node, at in hits.items() if node in program.landing]
        own = felt(program.model.mechanism, constraint.label)
        program.mode_constraint(i, "lands", view.z("q v"), own * rate, -soft / SPEED, INF, late)
    program.mode_constraint(i, "touch", view.z("q"), g, 0.0, 0.0, touching)
    if constraint.friction is not None:
        least = ModeConstraints.lands if soft is None else min(ModeConstraints.lands, soft / 2)
        low = -least / SPEED
        program.mode_constraint(i, "approach", view.z("q v"), rate, -INF, low, list(hits.values()))


def _held(program: PhaseProgram, view: View, i: int, constraint: Constraint) -> None:
    """A closed gap stays zero, and so does its rate, and the slip of a sticking contact."""
    c, phases = program.columns, program.phases
    gap = view.of(constraint.gap) / LENGTH
    ends = [(p, c.end(e + 1)["q"]) for e, p in enumerate(c.phase_of) if phases[p].active(i)]
    program.mode_constraint(i, "stays", view.z("q"), gap, 0.0, 0.0, ends)
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
    weight, places = program.model.mechanism.weight, constraint.friction
    tangential = program.model.node.lam[[places.forward, places.backward]]
    edges = (("forward", constraint.friction.cone_forward, BACK),
             ("backward", constraint.friction.cone_backward, AHEAD))  # fmt: skip
    for way, cone, sliding in edges:
        most = ca.substitute(cone, tangential, ca.SX.zeros(2))
        held = view.of(cone - (1.0 - program.task.grip) * most) / weight
        for wanted, g, high in ((HELD, held, INF), (sliding, view.of(cone) / weight, 0.0)):
            where = [(p, lam) for p, lam in forces if phases[p].modes[i] == wanted]
            program.mode_constraint(i, f"cone {way}", view.z(own), g, 0.0, high, where)


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


def add_requirements(
    program: PhaseProgram, requirements: Sequence[Requirement], start: Independent, end: Independent
) -> None:
    """Bounds where a requirement is about a variable, else rows; none where modes imply it."""
    view = View(program)
    program.requirements = requirements
    program.landing = landing_nodes(requirements, program.nodes)
    granted = _granted_at_end(program, view, end)
    tied = {r.quantity.name for r in requirements if r.minus and (r.minus.at, r.at) == (0.0, 1.0)}
    for expression in granted:  # what is closed at the end of a stride is closed at its start
        if _states_of(program, expression) <= tied:
            start.adds(view.of(expression), view, "the start of a stride")
    seen: set[tuple[object, ...]] = set()
    for requirement in requirements:
        if requirement.location[0] == "contacts":
            continue  # phases keep the contacts of the plan
        g = view.of(quantity_expression(program.model, requirement.quantity.name))
        z = view.z("q v s u lam")
        if requirement.minus is not None:
            _between_moments(program, view, requirement, g, z)
            continue
        key = requirement.at, requirement.during, str(g), requirement.lower, requirement.upper
        if ca.jacobian(g, z).nnz() == 0 or key in seen or _about_valves(program, view, g):
            continue
        seen.add(key)
        if requirement.aim:
            own, full = _variables(view, g)
            at = _columns(program, requirement.node(program.nodes), full)
            program.add_cost(own, aim_cost(requirement, g), at)
        last = program.nodes
        nodes = requirement.nodes(last)
        fixed = requirement.at is not None and requirement.lower == requirement.upper
        if fixed and not requirement.acts:
            moment = {0: start, last: end}.get(nodes[0])
            left = (g - requirement.lower) / requirement.scale
            if moment is not None and not moment.adds(left, view, f"`{requirement.text}`"):
                continue
        _put(program, view, requirement, g, nodes)


def _between_moments(
    program: PhaseProgram, view: View, requirement: Requirement, later: ca.SX, z: ca.SX
) -> None:
    """The rows, and the cost, of a requirement between two moments."""
    assert requirement.minus is not None
    earlier = view.of(quantity_expression(program.model, requirement.minus.name))
    if _about_valves(program, view, later) and _about_valves(program, view, earlier):
        return
    before = ca.SX.sym("before", z.numel())
    g = later - ca.substitute(earlier, z, before)
    own, full = _variables(view, later, earlier)
    both = ca.vertcat(before[: own.numel()], own)
    nodes = requirement.minus.node(program.nodes), requirement.node(program.nodes)
    at = np.concatenate([_columns(program, node, full) for node in nodes])
    scale = requirement.scale
    ends = requirement.lower / scale, requirement.upper / scale
    if requirement.aim:
        program.add_cost(both, aim_cost(requirement, g), at)
    program.add(requirement.label, both, g / scale, *ends, [at])


def _about_valves(program: PhaseProgram, view: View, g: ca.SX) -> bool:
    """Whether a requirement is about valves alone: phases keep them as the plan has them."""
    inputs = view.layout.slices["u"].start
    valves = [view.symbols["u"][c - inputs] for c in view.layout.binary]
    own = {str(symbol) for symbol in ca.symvar(g)}
    return own <= {str(symbol) for symbol in valves}


def _put(
    program: PhaseProgram, view: View, requirement: Requirement, g: ca.SX, nodes: list[int]
) -> None:
    variable = as_variable(g, view.z("q v s"))
    if variable is not None:
        index, factor, offset = variable
        at = [_columns(program, node, full=False)[index] for node in nodes]
        bounds = program.lower[at], program.upper[at]
        tighter = tighter_bounds(*bounds, factor, offset, requirement)
        if tighter is None:
            raise ContradictionError(f"other bounds exclude `{requirement.text}`")
        program.lower[at], program.upper[at] = tighter
        return
    scale, label = requirement.scale, requirement.label
    low, high = requirement.lower / scale, requirement.upper / scale
    z, full = _variables(view, g)
    columns = [_columns(program, node, full) for node in nodes]
    program.add(label, z, g / scale, low, high, columns)


def _variables(view: View, *expressions: ca.SX) -> tuple[ca.SX, bool]:
    """The symbols of a node that expressions are about, and whether inputs and forces are among
    them, which act on the interval before the node: at the first there is none."""
    full = any(ca.depends_on(g, view.z("u lam")) for g in expressions)
    return view.z("q v s u lam" if full else "q v s"), full


def _columns(program: PhaseProgram, node: int, full: bool) -> np.ndarray:
    at = program.columns.end(node)
    acting = [program.columns.u[node - 1], at["lam"]] if full and node > 0 else []
    return np.concatenate([*(at[g] for g in STATE), *acting])


def _granted_at_end(program: PhaseProgram, view: View, end: Independent) -> list[ca.SX]:
    """What the last phase's closed constraints imply at the last node: expressions that are 0."""
    found = []
    for constraint, mode in zip(program.constraints, program.phases[-1].modes, strict=True):
        if mode == 0:
            continue
        granted = [constraint.gap, constraint.rate]
        if constraint.friction is not None and mode == HELD:
            granted.append(constraint.friction.slip)
        for expression in granted:
            end.adds(view.of(expression), view, f"that {constraint.label} is closed at the end")
        found += granted
    return found


def _states_of(program: PhaseProgram, expression: ca.SX) -> set[str]:
    """The coordinates, rates and states of effects on which an expression of the node depends."""
    model, read = program.model, {str(symbol) for symbol in ca.symvar(expression)}
    return {
        quantity.name
        for group in STATE
        for i, quantity in enumerate(model.groups[group])
        if str(getattr(model.node, group)[i]) in read
    }
