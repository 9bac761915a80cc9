"""The multi-phase program begun from the implicit Euler plan on its grid, and solved by IPOPT;
the solution as a trajectory at element ends, and its own defects."""

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from kemba.ocp.certificate.asked import measured
from kemba.ocp.certificate.certify import Certificate, Violation, first_state, violations
from kemba.ocp.nlp.ending import Stagnation
from kemba.ocp.nlp.ipopt import Control, Ipopt, Iterate
from kemba.ocp.phases.between import add_missed
from kemba.ocp.phases.modes import phase_notes
from kemba.ocp.phases.program import Columns, PhaseProgram
from kemba.ocp.phases.radau import STATE
from kemba.ocp.phases.settings import Refining
from kemba.ocp.phases.stages import Stages
from kemba.ocp.transcription.layout import STEP
from kemba.ocp.transcription.solution import arrays, written
from kemba.trajectory import Trajectory


def node_rows(program: PhaseProgram, plan: Trajectory) -> np.ndarray:
    """Scaled half values (nodes + 1, n) of a plan; friction as one signed force."""
    groups = arrays(program.model, plan)
    groups["h"] = np.diff(plan.time, prepend=plan.time[0])[:, None]
    Y = program.layout.pack(groups)
    for forward, backward in program.frictions:
        Y[:, forward] -= Y[:, backward]
    return Y


def start_vector(program: PhaseProgram, plan: Trajectory) -> np.ndarray:
    """The program's scaled variables (size,) from a plan, phase by phase on even grids."""
    c, layout, t = program.columns, program.layout, plan.time
    Y = node_rows(program, plan)
    x = np.zeros(c.size)
    for g in STATE:
        x[c.first[g]] = Y[0, layout.slices[g]]
    for p, phase in enumerate(program.phases):
        a, b = phase.first, phase.last
        h = (t[b] - t[a]) / phase.elements
        x[c.h[p]] = h / STEP
        begins, rows = t[a] + np.arange(b - a) * h, slice(a + 1, b + 1)
        x[c.u[a:b]] = _between(t[rows], Y[rows, layout.slices["u"]], begins + h)
        for i, point in enumerate(program.scheme.points):
            for g in (*STATE, "lam"):
                rows = slice(a + int(g == "lam" or (g == "v" and p in c.after)), b + 1)
                index = np.array([c.stages[e][i][g] for e in range(a, b)])
                x[index] = _between(t[rows], Y[rows, layout.slices[g]], begins + point * h)
        if p in c.after:
            x[c.after[p]] = Y[a + 1, layout.slices["v"]]
            x[c.impulse[p]] = Y[a + 1, layout.slices["lam"]] * (t[a + 1] - t[a]) / STEP
    return np.clip(x, program.lower, program.upper)


def _between(times: np.ndarray, rows: np.ndarray, now: np.ndarray) -> np.ndarray:
    """Rows (k, n) at rising times (k,), interpolated to other times (m,); the ends beyond them."""
    if len(times) == 1:
        return np.repeat(rows, len(now), axis=0)
    i = np.clip(np.searchsorted(times, now), 1, len(times) - 1)
    share = np.clip((now - times[i - 1]) / (times[i] - times[i - 1]), 0.0, 1.0)[:, None]
    return np.asarray(rows[i - 1] + share * (rows[i] - rows[i - 1]))


def carried(program: PhaseProgram, old: Columns, points: np.ndarray, x: np.ndarray) -> np.ndarray:
    """The scaled variables (size,) of `program` from a solution `x` of the same order of phases on
    other elements, or of other phases on the same ones.

    Its variables are at the columns `old`, by a scheme with stages at `points`. States and forces
    are read off the polynomials of its elements, inputs in the middle of each new one.
    """
    c, y = program.columns, np.zeros(program.columns.size)
    knots = np.concatenate([[0.0], points])
    lasting = x[old.h[old.phase_of, 0]]
    ends = np.concatenate([[0.0], np.cumsum(lasting)])
    orders = [[(p.modes, p.valves) for p in phases] for phases in (program.phases, old.phases)]
    same = program.nodes == len(lasting) and orders[0] != orders[1]
    for g in STATE:
        y[c.first[g]] = x[old.first[g]]
    for p, phase in enumerate(program.phases):
        span = phase if same else old.phases[p]
        within = ends[span.first : span.last + 1] - ends[span.first]
        h = y[c.h[p]] = within[-1] / phase.elements
        for k in range(phase.elements):
            e = phase.first + k
            y[c.u[e]] = x[old.u[span.first + _element(within, (k + 0.5) * h)[0]]]
            for stage, point in zip(c.stages[e], program.scheme.points, strict=True):
                at, share = _element(within, (k + point) * h)
                begin, stages = old.begin(span.first + at), old.stages[span.first + at]
                states, forces = _lagrange(knots, share), _lagrange(points, share)
                for g in STATE:
                    y[stage[g]] = states @ np.array([x[begin[g]], *(x[s[g]] for s in stages)])
                y[stage["lam"]] = forces @ np.array([x[s["lam"]] for s in stages])
        if p in c.after:
            q = old.starts.get(span.first, -1)
            y[c.after[p]] = x[old.begin(span.first)["v"]]
            y[c.impulse[p]] = x[old.impulse[q]] if q in old.impulse else 0.0
    return np.clip(y, program.lower, program.upper)


def on_elements(program: PhaseProgram, solved: Stages) -> np.ndarray | None:
    """The program's scaled variables (size,) from a solution, on its elements or others of the same
    phases; None where its phases are others."""
    kept = solved.start(program)
    if kept is not None:
        return kept
    others = solved.scaled(program)
    return None if others is None else carried(program, others[0], program.scheme.points, others[1])


def _element(ends: np.ndarray, time: float) -> tuple[int, float]:
    """The element in which a time is, and its share of that element in (0, 1]; `ends`
    (elements + 1,): where the first begins and every one ends."""
    slack = 1e-9 * ends[-1]
    at = int(np.clip(np.searchsorted(ends, time - slack) - 1, 0, len(ends) - 2))
    return at, min(1.0, (time - ends[at]) / (ends[at + 1] - ends[at]))


def _lagrange(knots: np.ndarray, point: float) -> np.ndarray:
    """Weights (knots,) of values at knots in the value of their polynomial at a point."""
    powers = np.arange(len(knots))
    return np.asarray(np.linalg.solve(knots ** powers[:, None], point**powers))


def solve(
    program: PhaseProgram,
    start: Iterate,
    options: dict[str, Any],
    control: Control,
    stagnation: Stagnation | None = None,
) -> Iterate:
    """The program solved from `start`; given up where `stagnation` is found."""
    own = {**program.task.solver.options, **exact(), **options}
    return Ipopt(program, own, control).solve(start, stagnation=stagnation)


ROUNDS = 4  # of rows between nodes; what is missed after two is little


def solve_along(
    program: PhaseProgram, start: Iterate, options: dict[str, Any], *more: Any
) -> Iterate:
    """The same, and again with rows between nodes wherever the solution misses there what holds
    along the motion. Where that has no solution near, the last one that was found."""
    found = solve(program, start, options, *more)
    spent = found.iterations
    for _ in range(ROUNDS):
        known = program.added
        if not found.solved or not add_missed(program, found.Y):
            break
        again = solve(program, Iterate(found.Y), warm(options["max_iter"]), *more)
        spent += again.iterations
        if not again.solved:
            program.reset(known)
            break
        found = again
    return replace(found, iterations=spent)


def exact() -> dict[str, Any]:
    """IPOPT options of the finer scheme."""
    return {
        "tol": Refining.tol,
        "constr_viol_tol": Refining.rows,
        "acceptable_iter": 0,
        "mumps_pivtol": Refining.pivot,
        "mumps_permuting_scaling": Refining.permuting,
        "max_hessian_perturbation": Refining.hessian,
    }


def warm(iterations: int) -> dict[str, Any]:
    """IPOPT options of a warm start on primal values, with at most `iterations`."""
    push = {"bound_push": Refining.push, "bound_frac": Refining.push}
    return {"mu_init": Refining.mu, **push, "max_iter": iterations}


def rough(iterations: int) -> dict[str, Any]:
    """The same for the coarser scheme, whose solution is only a start."""
    return {**warm(iterations), "tol": Refining.rough_tol, "constr_viol_tol": Refining.rough_rows}


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
