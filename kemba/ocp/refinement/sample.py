"""The solved multi-phase program as a trajectory at element ends, and its own defects."""

import casadi as ca
import numpy as np

from kemba.ocp.certificate.asked import measured
from kemba.ocp.certificate.certify import Certificate, Violation, first_state, violations
from kemba.ocp.phases.modes import phase_notes
from kemba.ocp.phases.program import PhaseProgram
from kemba.ocp.phases.radau import STATE
from kemba.ocp.transcription.layout import STEP
from kemba.ocp.transcription.solution import arrays, written
from kemba.trajectory import Trajectory

PHYSICS = ("kinematics", "dynamics", "rate", "impact")  # first words of their rows
WORST = 8


def to_trajectory(program: PhaseProgram, x: np.ndarray) -> Trajectory:
    """Every quantity of the model at element ends, just before an impact there.

    `x` (size,): scaled variables. Inputs and forces of a row act on the interval before it; at the
    first node they are zero. Impacts are not in the forces: their impulses on the feet have
    columns of their own.
    """
    layout, c = program.layout, program.columns
    nodes = program.nodes
    Y = np.zeros((nodes + 1, layout.size))
    rates = np.zeros_like(Y)
    part = layout.slices
    h = np.array([x[c.h[c.phase_of[e]]][0] for e in range(nodes)]) * STEP
    for g in ("q", "v", "s"):
        Y[0, part[g]] = x[c.first[g]]
    for e in range(nodes):
        begin, stages = c.begin(e), c.stages[e]
        for g in ("q", "v", "s"):
            Y[e + 1, part[g]] = x[stages[-1][g]]
            steps = np.array([x[stage[g]] - x[begin[g]] for stage in stages])
            rates[e + 1, part[g]] = program.scheme.slopes[-1] @ steps / h[e]
        Y[e + 1, part["lam"]] = x[stages[-1]["lam"]]
        Y[e + 1, part["u"]] = x[c.u[e]]
    Y[:, layout.binary] = np.round(Y[:, layout.binary])
    _split_friction(program, Y)
    values = {g: layout.full(Y, g) for g in ("q", "v", "s", "u", "lam")}
    values["lam"] = _slip_speeds(program, values["q"], values["v"], values["lam"])
    times = np.concatenate([[0.0], np.cumsum(h)])
    a, sd = layout.full(rates, "v"), layout.full(rates, "s")
    plan = written(program.model, program.task.name, times, values, a, sd)
    plan.meta |= phase_notes(program.phases, program.constraints)
    return plan.with_columns(_impulses(program, x))


def _impulses(program: PhaseProgram, x: np.ndarray) -> dict[str, np.ndarray]:
    """Columns of the impulses [N.s] on the feet, in the row of their impact; zero elsewhere."""
    layout, c = program.layout, program.columns
    Y = np.zeros((program.nodes + 1, layout.size))
    for p in program.impacts:
        Y[program.phases[p].first, layout.slices["lam"]] = x[c.impulse[p]] * STEP
    _split_friction(program, Y)
    names = [quantity.name for quantity in program.model.forces.values()]
    at = dict(zip(names, layout.full(Y, "lam").T, strict=True))
    columns = {}
    for leg in program.model.mechanism.legs:
        forward, backward = (at.get(f"{leg}/foot/Fx_{way}") for way in ("forward", "backward"))
        if forward is not None and backward is not None:
            columns[f"{leg}/foot/impulse_x [N.s]"] = forward - backward
        if f"{leg}/foot/Fz" in at:
            columns[f"{leg}/foot/impulse_z [N.s]"] = at[f"{leg}/foot/Fz"]
    return columns


def _split_friction(program: PhaseProgram, Y: np.ndarray) -> None:
    """One signed friction force as its forward and backward part."""
    for forward, backward in program.frictions:
        force = Y[:, forward].copy()
        Y[:, forward], Y[:, backward] = np.maximum(force, 0.0), np.maximum(-force, 0.0)


def _slip_speeds(
    program: PhaseProgram, q: np.ndarray, v: np.ndarray, lam: np.ndarray
) -> np.ndarray:
    """Forces with every slip speed that the pairs ask for: its size."""
    node, B = program.model.node, program.reduction.B["lam"]
    lam = lam.copy()
    for constraint in program.constraints:
        friction = constraint.friction
        if friction is None:
            continue
        slip = ca.Function("slip", [node.q, node.v], [friction.slip])
        size = np.abs(np.array(slip.map(len(q))(q.T, v.T)).ravel())
        for place in np.flatnonzero(B[:, program.place(friction.speed)]):
            lam[1:, place] = size[1:]
    return lam


def certificate(program: PhaseProgram, x: np.ndarray, trajectory: Trajectory) -> Certificate:
    """What the solution x (size,) violates.

    dynamics: collocation and impacts; bounds: modes, bounds, requirements and the first state;
    complementarity: forces times gaps at the ends of elements.
    """
    g = np.array(program.problem.g(x, [])).ravel()
    over = np.maximum(np.maximum(program.g_lower - g, g - program.g_upper), 0.0)
    rows = program.rows
    found = []
    for i in np.argsort(-over)[:WORST]:
        node, size = rows[i].node, float(over[i])
        if size > 1e-9:
            time = float(trajectory.time[node])
            found.append(Violation(rows[i].label, node, time, size, "of its scale", size))
    physics = np.array([row.label.split(":")[0] in PHYSICS for row in rows])
    boxes = np.maximum(program.lower - x, x - program.upper)
    start = arrays(program.model, trajectory)
    first = first_state(program.model, *(start[name][0] for name in STATE))
    asked = measured(program.model, program.task, program.requirements, trajectory)
    return Certificate(
        complementarity=_complementarity(program, trajectory),
        binary=0.0,  # valves are rounded constants of their phase
        dynamics=float(np.max(over[physics], initial=0.0)),
        bounds=max(float(np.max(part, initial=0.0)) for part in (boxes, over[~physics], -first)),
        worst=tuple(sorted((*violations(asked), *found), key=lambda v: -v.size)[:WORST]),
        asked=asked,
    )


def _complementarity(program: PhaseProgram, trajectory: Trajectory) -> float:
    model, node = program.model, program.model.node
    x = arrays(model, trajectory)
    q, v, s, lam, u = (x[name][1:].T for name in ("q", "v", "s", "lam", "u"))
    zero_a, zero_s = np.zeros_like(v), np.zeros_like(s)
    _, _, a, b, _ = node.residual.map(q.shape[1])(q, v, zero_a, s, zero_s, lam, u, [])
    scale = np.array([[row.scale] for _, row in node.pair_rows])
    return float(np.max(np.abs(np.array(a) * np.array(b) / scale), initial=0.0))
