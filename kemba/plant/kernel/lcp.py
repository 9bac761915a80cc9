"""Small linear complementarity problems: 0 <= z _|_ w = A z + b >= 0.

Contact modes rarely change from one step to the next, so the last one is tried first; Lemke's
method (lexicographic, hence finite for contact with friction: Stewart and Trinkle, 1996) answers
where that fails.
"""

from __future__ import annotations

import numpy as np

from kemba.plant.kernel.jit import kernel
from kemba.plant.kernel.lemke import lemke
from kemba.plant.kernel.linear import solve_pivoted
from kemba.plant.stepping.arrays import Array

ROUNDING = 1e-11  # of the terms of a row; a smaller violation is none
SWAPS = 6  # changes of the active set before Lemke's method takes over


@kernel
def solve_lcp(A: Array, b: Array, guess: Array) -> tuple[Array, Array]:
    """Solution z (n,) and its active set, starting from the active set `guess` (n,) of booleans.

    Raises NoSolutionError.
    """
    n = len(b)
    z, on = np.zeros(n), guess.copy()
    if _active_set(A, b, on, z):
        return z, on
    on[:] = False
    if _active_set(A, b, on, z):
        return z, on
    row, column = _scales(A)
    scaled = np.empty((n, n))
    for i in range(n):
        for j in range(n):
            scaled[i, j] = row[i] * A[i, j] * column[j]
    z = column * lemke(scaled, row * b)
    for i in range(n):
        on[i] = z[i] > 0.0
    return z, on


@kernel
def _scales(A: Array) -> tuple[Array, Array]:
    """Scales of rows and columns that let forces and slip speeds compare: a force has a diagonal,
    a slip speed and its cone have none."""
    n = len(A)
    count, total = 0, 0.0
    for i in range(n):
        if A[i, i] > 0.0:
            count, total = count + 1, total + A[i, i]
    usual = total / count if count else 1.0
    row, column = np.full(n, usual), np.ones(n)
    for i in range(n):
        if A[i, i] > 0.0:
            row[i], column[i] = usual / A[i, i], 1.0 / usual
    return row, column


@kernel
def _active_set(A: Array, b: Array, on: Array, z: Array) -> bool:
    """Change the active set `on` until it gives a solution z; whether one was found."""
    n = len(b)
    inner, right = np.empty((n, n)), np.empty(n)
    index = np.empty(n, dtype=np.int64)
    for _ in range(SWAPS):
        size = 0
        for i in range(n):
            if on[i]:
                index[size] = i
                size += 1
        for k in range(size):
            right[k] = -b[index[k]]
            for j in range(size):
                inner[k, j] = A[index[k], index[j]]
        if not solve_pivoted(inner, right, size):
            return False
        z[:] = 0.0
        largest = 0.0
        for k in range(size):
            z[index[k]] = right[k]
            largest = max(largest, abs(right[k]))
        if not _corrected(A, b, on, z, largest):
            for i in range(n):
                z[i] = max(z[i], 0.0)
            return True
    return False


@kernel
def _corrected(A: Array, b: Array, on: Array, z: Array, largest: float) -> bool:
    """Move every row that is on the wrong side to the other; whether there was one."""
    changed = False
    for i in range(len(b)):
        w, terms = b[i], abs(b[i])
        for j in range(len(b)):
            w += A[i, j] * z[j]
            terms += abs(A[i, j] * z[j])
        if (z[i] < -ROUNDING * largest) if on[i] else (w < -ROUNDING * terms):
            on[i] = not on[i]
            changed = True
    return changed
