"""Lemke's complementary pivoting for 0 <= z _|_ w = A z + b >= 0."""

from __future__ import annotations

from kemba.plant.kernel.jit import kernel, part
from kemba.plant.kernel.machine import Lcp
from kemba.plant.kernel.settings import Complementarity
from kemba.plant.stepping.arrays import Array

_NUMBERS = Complementarity.current()
NEGLIGIBLE, TIE, PIVOTS = _NUMBERS.negligible, _NUMBERS.tie, _NUMBERS.pivots


class NoSolutionError(ArithmeticError):
    """The complementarity problem has no solution that pivoting can reach."""


@part
def lemke(w: Lcp, n: int) -> None:
    """Pivot `w.table`, whose columns are w (n), z (n), the artificial variable, right-hand side.

    Afterwards `w.basis` names the column that each row determines. Raises NoSolutionError when
    pivoting ends on a ray.
    """
    row = 0
    for i in range(n):
        w.basis[i] = i
        if w.table[i, 2 * n + 1] < w.table[row, 2 * n + 1]:
            row = i
    if w.table[row, 2 * n + 1] >= 0.0:
        return
    entering = 2 * n
    for _ in range(PIVOTS * n):
        leaving = w.basis[row]
        _pivot(w.table, n, row, entering)
        w.basis[row] = entering
        if leaving == 2 * n:
            return
        entering = leaving + n if leaving < n else leaving - n
        row = _leaving_row(w, n, entering)
        if row < 0:
            raise NoSolutionError("the contact forces have no solution")
    raise NoSolutionError("the contact forces do not settle")


@kernel
def _pivot(table: Array, n: int, row: int, column: int) -> None:
    pivot = table[row, column]
    for j in range(2 * n + 2):
        table[row, j] /= pivot
    for i in range(n):
        ratio = table[i, column]
        if i != row and ratio != 0.0:
            for j in range(2 * n + 2):
                table[i, j] -= ratio * table[row, j]


@kernel
def _leaving_row(w: Lcp, n: int, entering: int) -> int:
    """Row of the smallest ratio, -1 where there is none; ties go to the artificial variable, else
    lexicographically."""
    largest = 1.0
    for i in range(n):
        largest = max(largest, abs(w.table[i, entering]))
    for i in range(n):
        w.left[i] = w.table[i, entering] > NEGLIGIBLE * largest
    first = -1
    for key in range(-1, n):
        column = 2 * n + 1 if key < 0 else key
        least = 1e300
        for i in range(n):
            if w.left[i]:
                least = min(least, w.table[i, column] / w.table[i, entering])
        count, first = 0, -1
        for i in range(n):
            if w.left[i]:
                ratio = w.table[i, column] / w.table[i, entering]
                w.left[i] = ratio <= least + TIE * (1.0 + abs(least))
            if w.left[i]:
                if key < 0 and w.basis[i] == 2 * n:
                    return i
                count += 1
                if first < 0:
                    first = i
        if count < 2:
            break
    return first
