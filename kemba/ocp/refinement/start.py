"""The multi-phase program begun from the implicit Euler plan on its grid, and solved by IPOPT."""

from typing import Any

import numpy as np

from kemba.ocp.nlp.ending import Stagnation
from kemba.ocp.nlp.ipopt import Control, Ipopt, Iterate
from kemba.ocp.phases.program import Columns, PhaseProgram
from kemba.ocp.phases.radau import STATE
from kemba.ocp.phases.settings import Refining
from kemba.ocp.phases.stages import Stages
from kemba.ocp.transcription.layout import STEP
from kemba.ocp.transcription.solution import arrays
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
    """The scaled variables (size,) of `program` from a solution `x` of the same phases, on the same
    number of elements or another, or of other phases on the same elements.

    Its variables are at the columns `old`, by a scheme with stages at `points`. States and forces
    are read off the polynomials of its elements, inputs in the middle of each new one.
    """
    c, y = program.columns, np.zeros(program.columns.size)
    knots = np.concatenate([[0.0], points])
    lasting = x[old.h[old.phase_of, 0]]
    ends = np.concatenate([[0.0], np.cumsum(lasting)])
    same = program.nodes == len(lasting)
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
    """The program solved from `start`; given up where the violation stagnates, by default as the
    settings say."""
    settings = Refining.current()
    own = {**program.task.solver.options, **exact(), **options}
    longest = settings.stagnation_iterations, settings.stagnation_near, settings.slow
    if program.elastic > 0.0:  # such a program has a solution
        stagnation = Stagnation(np.inf, 0.0)
    stagnation = stagnation or Stagnation(*longest)
    return Ipopt(program, own, control).solve(start, stagnation=stagnation)


def exact() -> dict[str, Any]:
    """IPOPT options of the finer scheme."""
    settings = Refining.current()
    return {
        "tol": settings.tol,
        "constr_viol_tol": settings.rows,
        "acceptable_iter": 0,
        "mumps_pivtol": settings.pivot,
        "mumps_permuting_scaling": settings.permuting,
        "max_hessian_perturbation": settings.hessian,
    }


def warm(iterations: int) -> dict[str, Any]:
    """IPOPT options of a warm start on primal values, with at most `iterations`."""
    settings = Refining.current()
    push = {"bound_push": settings.push, "bound_frac": settings.push}
    return {"mu_init": settings.mu, **push, "max_iter": iterations}


def rough(iterations: int) -> dict[str, Any]:
    """The same for the coarser scheme, whose solution is only a start."""
    settings = Refining.current()
    return {**warm(iterations), "tol": settings.rough_tol, "constr_viol_tol": settings.rough_rows}
