"""The start of the multi-phase program: the implicit Euler plan on its grid."""

from __future__ import annotations

import numpy as np

from kemba.ocp.phases.program import PhaseProgram
from kemba.ocp.phases.radau import STATE
from kemba.ocp.transcription.layout import STEP
from kemba.ocp.transcription.solution import arrays
from kemba.trajectory import Trajectory


def node_rows(program: PhaseProgram, plan: Trajectory) -> np.ndarray:
    """Scaled half values (nodes + 1, n) of a plan; friction as one signed force."""
    groups = arrays(program.model, plan)
    groups["h"] = np.diff(plan.time, prepend=plan.time[0])[:, None]
    Y = program.layout.pack(groups)
    offset = program.layout.slices["lam"].start
    for constraint in program.constraints:
        if constraint.friction is not None:
            forward = offset + program.place(constraint.friction.forward)
            backward = offset + program.place(constraint.friction.backward)
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


def carried(program: PhaseProgram, coarse: PhaseProgram, x: np.ndarray) -> np.ndarray:
    """The scaled variables (size,) of `program` from a solution `x` (coarse size,) of the same
    phases by another scheme."""
    c, old = program.columns, coarse.columns
    y = np.zeros(c.size)
    knots = np.concatenate([[0.0], coarse.scheme.points])
    states = _lagrange(knots, program.scheme.points)
    forces = _lagrange(knots[1:], program.scheme.points)
    for g in STATE:
        y[c.first[g]] = x[old.first[g]]
    for e in range(program.nodes):
        begin, stages = old.begin(e), old.stages[e]
        for g in STATE:
            values = states @ np.array([x[begin[g]], *(x[stage[g]] for stage in stages)])
            for stage, value in zip(c.stages[e], values, strict=True):
                y[stage[g]] = value
        values = forces @ np.array([x[stage["lam"]] for stage in stages])
        for stage, value in zip(c.stages[e], values, strict=True):
            y[stage["lam"]] = value
        y[c.u[e]] = x[old.u[e]]
    y[c.h] = x[old.h]
    for p in program.impacts:
        y[c.after[p]], y[c.impulse[p]] = x[old.after[p]], x[old.impulse[p]]
    return np.clip(y, program.lower, program.upper)


def _lagrange(knots: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Matrix from values at knots to values of their polynomial at points."""
    powers = np.arange(len(knots))
    return np.asarray(points[:, None] ** powers @ np.linalg.inv(knots[:, None] ** powers))
