"""A task's requirements on the multi-phase program, at element ends."""

from collections.abc import Sequence

import casadi as ca
import numpy as np

from kemba.ocp.phases.independent import ContradictionError, Independent
from kemba.ocp.phases.modes import HELD
from kemba.ocp.phases.program import PhaseProgram, View
from kemba.ocp.task.requirement import Requirement, apex_node, quantity_expression
from kemba.ocp.transcription.stage import aim_cost, as_variable, tighter_bounds

INF = np.inf


def add_requirements(
    program: PhaseProgram, requirements: Sequence[Requirement], start: Independent, end: Independent
) -> None:
    """Bounds where a requirement is about a variable, else rows; none where modes imply it."""
    view = View(program)
    program.requirements = requirements
    program.apex = apex_node(requirements, program.nodes)
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
            at = _columns(program, requirement.node(program.nodes), full=True)
            program.add_cost(z, aim_cost(requirement, g), at)
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
    names, full = "q v s u lam", True
    if not (ca.depends_on(later, view.z("u lam")) or ca.depends_on(earlier, view.z("u lam"))):
        names, full = "q v s", False
    state = view.z(names).numel()
    both = ca.vertcat(before[:state], z[:state])
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
    columns = [_columns(program, node, full=variable is None) for node in nodes]
    if variable is not None:
        index, factor, offset = variable
        ends = sorted(
            ((requirement.lower - offset) / factor, (requirement.upper - offset) / factor)
        )
        at = [z[index] for z in columns]
        tighter = tighter_bounds(program.lower[at], program.upper[at], ends)
        if tighter is None:
            raise ContradictionError(f"other bounds exclude `{requirement.text}`")
        program.lower[at], program.upper[at] = tighter
        return
    scale, label = requirement.scale, requirement.label
    low, high = requirement.lower / scale, requirement.upper / scale
    if not ca.depends_on(g, view.z("u lam")):
        columns = [_columns(program, node, full=False) for node in nodes]
        if requirement.location[0] == "obstacles":  # within every element too
            within = [at for stages in program.columns.stages for at in stages[:-1]]
            columns += [np.concatenate([at["q"], at["v"], at["s"]]) for at in within]
        program.add(label, view.z("q v s"), g / scale, low, high, columns)
        return
    program.add(label, view.z("q v s u lam"), g / scale, low, high, columns)


def _columns(program: PhaseProgram, node: int, full: bool) -> np.ndarray:
    c = program.columns
    at = c.end(node)
    parts = [at["q"], at["v"], at["s"]]
    if full and node > 0:
        parts += [c.u[node - 1], at["lam"]]
    return np.concatenate(parts)


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
    model, node = program.model, program.model.node
    mechanism = model.mechanism
    listed = [
        (mechanism.coordinates, node.q),
        (mechanism.velocities, node.v),
        (model.states.values(), node.s),
    ]
    read = {str(symbol) for symbol in ca.symvar(expression)}
    return {
        q.name
        for quantities, symbols in listed
        for q, symbol in zip(quantities, ca.vertsplit(symbols), strict=True)
        if str(symbol) in read
    }
