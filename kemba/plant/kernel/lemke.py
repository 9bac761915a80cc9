"""Lemke's complementary pivoting for 0 <= z _|_ w = A z + b >= 0."""

from __future__ import annotations

import numpy as np

from kemba.plant.kernel.jit import kernel
from kemba.plant.stepping.arrays import Array


class NoSolutionError(ArithmeticError):
    """The complementarity problem has no solution that pivoting can reach."""


@kernel
def lemke(A: Array, b: Array) -> Array:
    """The solution z (n,). Raises NoSolutionError when pivoting ends on a ray."""
    n = len(b)
    if (b >= 0.0).all():
        return np.zeros(n)
    # columns: w (n), z (n), the artificial variable, right-hand side
    table = np.zeros((n, 2 * n + 2))
    basis = np.arange(n)
    row = 0
    for i in range(n):
        table[i, i], table[i, 2 * n], table[i, 2 * n + 1] = 1.0, -1.0, b[i]
        for j in range(n):
            table[i, n + j] = -A[i, j]
        if b[i] < b[row]:
            row = i
    entering = 2 * n
    for _ in range(50 * n):
        leaving = basis[row]
        _pivot(table, row, entering)
        basis[row] = entering
        if leaving == 2 * n:
            return _solution(table, basis)
        entering = leaving + n if leaving < n else leaving - n
        row = _leaving_row(table, entering, basis)
    raise NoSolutionError("the contact forces do not settle")


@kernel
def _solution(table: Array, basis: Array) -> Array:
    n = len(table)
    z = np.zeros(n)
    for i in range(n):
        if n <= basis[i] < 2 * n:
            z[basis[i] - n] = max(table[i, 2 * n + 1], 0.0)
    return z


@kernel
def _pivot(table: Array, row: int, column: int) -> None:
    pivot = table[row, column]
    for j in range(table.shape[1]):
        table[row, j] /= pivot
    for i in range(len(table)):
        ratio = table[i, column]
        if i != row and ratio != 0.0:
            for j in range(table.shape[1]):
                table[i, j] -= ratio * table[row, j]


@kernel
def _leaving_row(table: Array, entering: int, basis: Array) -> int:
    """Row of the smallest ratio; ties go to the artificial variable, else lexicographically."""
    n = len(table)
    largest = 1.0
    for i in range(n):
        largest = max(largest, abs(table[i, entering]))
    left = np.empty(n, dtype=np.bool_)
    for i in range(n):
        left[i] = table[i, entering] > 1e-11 * largest
    if not left.any():
        raise NoSolutionError("the contact forces have no solution")
    for key in range(-1, n):
        column = 2 * n + 1 if key < 0 else key
        least = np.inf
        for i in range(n):
            if left[i]:
                least = min(least, table[i, column] / table[i, entering])
        count = 0
        for i in range(n):
            if left[i]:
                left[i] = table[i, column] / table[i, entering] <= least + 1e-12 * (
                    1.0 + abs(least)
                )
                count += left[i]
                if key < 0 and left[i] and basis[i] == 2 * n:
                    return i
        if count == 1:
            break
    return int(np.argmax(left))
