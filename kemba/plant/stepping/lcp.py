"""Small linear complementarity problems: 0 <= z _|_ w = A z + b >= 0.

Contact modes rarely change from one step to the next, so the last one is tried first; Lemke's
method (lexicographic, hence finite for contact with friction: Stewart and Trinkle, 1996) answers
where that fails.
"""

from __future__ import annotations

import numpy as np

from kemba.plant.stepping.arrays import Array

ROUNDING = 1e-11  # of the terms of a row; a smaller violation is none
SWAPS = 6  # changes of the active set before Lemke's method takes over


class NoSolutionError(ArithmeticError):
    """The complementarity problem has no solution that pivoting can reach."""


def solve_lcp(A: Array, b: Array, guess: Array) -> tuple[Array, Array]:
    """Solution z (n,) and its active set, starting from the active set `guess` (n,) of booleans.

    Raises NoSolutionError.
    """
    for start in (guess, np.zeros(len(b), dtype=bool)):
        found = _active_set(A, b, start)
        if found is not None:
            return found
    row, column = _scales(A)
    z = column * lemke(row[:, None] * A * column, row * b)
    return z, z > 0.0


def _scales(A: Array) -> tuple[Array, Array]:
    """Scales of rows and columns that let forces and slip speeds compare: a force has a diagonal,
    a slip speed and its cone have none."""
    diagonal = A.diagonal()
    force = diagonal > 0.0
    usual = float(np.median(diagonal[force])) if force.any() else 1.0
    with np.errstate(divide="ignore"):
        row = np.where(force, usual / diagonal, usual)
    return row, np.where(force, 1.0 / usual, 1.0)


def _active_set(A: Array, b: Array, on: Array) -> tuple[Array, Array] | None:
    z = np.zeros(len(b))
    for _ in range(SWAPS):
        z[:] = 0.0
        if on.any():
            try:
                z[on] = np.linalg.solve(A[on][:, on], -b[on])
            except np.linalg.LinAlgError:
                return None
        size = np.abs(z)
        w, terms = A @ z + b, np.abs(A) @ size + np.abs(b)
        wrong = np.where(on, z < -ROUNDING * size.max(), w < -ROUNDING * terms)
        if not wrong.any():
            return np.maximum(z, 0.0), on
        on = on ^ wrong
    return None


def lemke(A: Array, b: Array) -> Array:
    """Lemke's complementary pivoting. Raises NoSolutionError when it ends on a ray."""
    n = len(b)
    if (b >= 0.0).all():
        return np.zeros(n)
    # columns: w (n), z (n), the artificial variable, right-hand side
    table = np.hstack([np.eye(n), -A, -np.ones((n, 1)), b[:, None]])
    basis = np.arange(n)
    row, entering = int(np.argmin(b)), 2 * n
    for _ in range(50 * n):
        leaving = int(basis[row])
        _pivot(table, row, entering)
        basis[row] = entering
        if leaving == 2 * n:
            z = np.zeros(2 * n + 1)
            z[basis] = table[:, -1]
            return np.maximum(z[n : 2 * n], 0.0)
        entering = leaving + n if leaving < n else leaving - n
        row = _leaving_row(table, entering, basis)
    raise NoSolutionError("the contact forces do not settle")


def _pivot(table: Array, row: int, column: int) -> None:
    table[row] /= table[row, column]
    others = np.arange(len(table)) != row
    table[others] -= np.outer(table[others, column], table[row])


def _leaving_row(table: Array, entering: int, basis: Array) -> int:
    """Row of the smallest ratio; ties go to the artificial variable, else lexicographically."""
    n = len(table)
    column = table[:, entering]
    rows = np.flatnonzero(column > 1e-11 * max(1.0, np.abs(column).max()))
    if not len(rows):
        raise NoSolutionError("the contact forces have no solution")
    for key in (-1, *range(n)):
        ratio = table[rows, key] / column[rows]
        rows = rows[ratio <= ratio.min() + 1e-12 * (1.0 + abs(ratio.min()))]
        artificial = rows[basis[rows] == 2 * n]
        if key == -1 and len(artificial):
            return int(artificial[0])
        if len(rows) == 1:
            break
    return int(rows[0])
