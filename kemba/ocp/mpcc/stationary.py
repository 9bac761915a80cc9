"""Whether a point of a program with pairs is stationary, by its own derivatives.

Strongly stationary: of pairs with both sides zero, neither multiplier pulls a side below zero. No
direction descends then. Where one does, the multipliers may not be the only ones, or another
branch may be cheaper: the linear program with complementarity pairs decides (B-stationarity).
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import casadi as ca
import numpy as np

from kemba.ocp.mpcc.problem import Mpcc

STEP = 1e-3  # how far the linear program looks, relative to each variable's size
LONGEST = 10.0  # s, of the linear program


@dataclass(frozen=True)
class Multipliers:
    """Of a point on a branch: of the bounds (n,) and rows (rows,), as CasADi signs them, of the
    sides G and H (pairs,), positive where they push the sides up; `residual`: what is left of the
    Lagrangian's gradient, relative to the largest multiplier."""

    lam_x: np.ndarray
    lam_g: np.ndarray
    nu_first: np.ndarray
    nu_second: np.ndarray
    residual: float


def multipliers(program: Mpcc, x: np.ndarray, lam_g: np.ndarray, first: np.ndarray) -> Multipliers:
    """The multipliers at x (n,) on the branch `first` (pairs,), from those of its rows.

    Those of bounds are what the rows leave of the gradient, where a bound or a fixed side can take
    it up: IPOPT does not give them for fixed variables.
    """
    _, gradient = program.problem.grad_f(x, program.p)
    _, jacobian = program.problem.jac_g(x, program.p)
    left = np.array(gradient + ca.mtimes(jacobian.T, lam_g)).ravel()
    rows = program.branch(first)
    near = 1e-6 * (1.0 + np.abs(x))
    low, high = x - rows.lower <= near, rows.upper - x <= near
    takes = (low & (left > 0)) | (high & (left < 0)) | (low & high)
    lam_x = np.where(takes, -left, 0.0)
    size = 1.0 + max(np.max(np.abs(lam_g), initial=0.0), np.max(np.abs(lam_x), initial=0.0))
    m = program.g_rows
    of_sides = lam_g[m : program.problem.rows - program.pairs]
    pushes = -np.concatenate([lam_x, of_sides])
    nu_first, nu_second = pushes[program.a], pushes[program.b]
    residual = float(np.max(np.abs(left + lam_x), initial=0.0) / size)
    return Multipliers(lam_x, lam_g[:m], nu_first, nu_second, residual)


def both_zero(program: Mpcc, x: np.ndarray, near: float) -> np.ndarray:
    """Which pairs have both sides at zero at x (n,), to `near`: (pairs,)."""
    values = program.places(x)
    return np.asarray(np.maximum(values[program.a], values[program.b]) <= near)


def pulled(found: Multipliers, zero: np.ndarray) -> np.ndarray:
    """Which of the pairs `zero` (pairs,) have a side whose multiplier pulls it below zero."""
    size = 1.0 + max(
        np.max(np.abs(found.nu_first), initial=0.0), np.max(np.abs(found.nu_second), initial=0)
    )
    return np.asarray(zero & (np.minimum(found.nu_first, found.nu_second) < -1e-6 * size))


def descending(
    program: Mpcc, x: np.ndarray, first: np.ndarray, zero: np.ndarray
) -> tuple[float, np.ndarray] | None:
    """The steepest descent of the linearised program within STEP of x (n,), over the branches of
    the pairs `zero` (pairs,): the cost's fall and the branch. None where none was found in time."""
    from scipy.optimize import Bounds, LinearConstraint, milp
    from scipy.sparse import csc_matrix, eye, hstack, vstack

    _, gradient = program.problem.grad_f(x, program.p)
    values, jacobian = program.problem.jac_g(x, program.p)
    pattern, shape = jacobian.sparsity(), (program.problem.rows, program.size)
    rows = csc_matrix((jacobian.nonzeros(), pattern.row(), pattern.colind()), shape=shape)
    inside, n, ties = program.problem.rows - program.pairs, program.size, np.flatnonzero(zero)
    rows = rows[:inside]  # products are left out: sides say them
    at = np.concatenate([x, np.array(values).ravel()[:inside]])
    wide = program.relaxed(np.inf)
    low = np.concatenate([wide.lower, wide.g_lower[:inside]]) - at
    high = np.concatenate([wide.upper, wide.g_upper[:inside]]) - at
    a, b = (place + program.g_rows * (place >= n) for place in (program.a, program.b))
    fixed = np.where(first, a, b)[~zero]
    high[fixed] = -at[fixed]
    low, high = np.minimum(low, 0.0), np.maximum(high, 0.0)  # the point itself is feasible
    reach = STEP * (1.0 + np.abs(x))
    sides = vstack([eye(n, format="csr"), rows]).tocsr()
    big = 1.0 + float((abs(sides) @ reach).max(initial=0.0))
    switch, k = big * eye(len(ties)), len(ties)
    with _quiet():
        found = milp(
            np.concatenate([np.array(gradient).ravel(), np.zeros(k)]),
            integrality=np.repeat([0, 1], [n, k]),
            bounds=Bounds(
                np.concatenate([np.maximum(low[:n], -reach), np.zeros(k)]),
                np.concatenate([np.minimum(high[:n], reach), np.ones(k)]),
            ),
            constraints=[
                LinearConstraint(hstack([rows, csc_matrix((inside, k))]), low[n:], high[n:]),
                LinearConstraint(hstack([sides[a[ties]], -switch]), -np.inf, 0.0),  # a <= big z
                LinearConstraint(
                    hstack([sides[b[ties]], switch]), -np.inf, big
                ),  # b <= big (1 - z)
            ],
            options={"time_limit": LONGEST},
        )
    if found.x is None:
        return None
    branch = first.copy()
    branch[ties] = found.x[n:] < 0.5
    return float(-found.fun), branch


@contextmanager
def _quiet() -> Iterator[None]:
    """No standard output: HiGHS (SciPy 1.15 to 1.17) prints a line where it repairs a point."""
    kept, nothing = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nothing, 1)
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nothing)
