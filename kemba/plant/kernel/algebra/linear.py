"""Linear systems of a dozen unknowns."""

from __future__ import annotations

from kemba.plant.kernel.jit import kernel, part
from kemba.plant.stepping.arrays import Array


@kernel
def factor(A: Array) -> None:
    """Factors of A (n, n) in its place, by elimination without pivoting.

    For matrices whose symmetric part is positive definite, as inertia with dissipation is.
    """
    n = len(A)
    for k in range(n):
        for i in range(k + 1, n):
            if A[i, k] != 0.0:
                ratio = A[i, k] / A[k, k]
                A[i, k] = ratio
                for j in range(k + 1, n):
                    A[i, j] -= ratio * A[k, j]


@kernel
def solve(factors: Array, X: Array, columns: int) -> None:
    """The first `columns` of X (n, m) replaced by the solution of A Y = X, from A's factors."""
    n = len(factors)
    for k in range(n):
        for i in range(k + 1, n):
            ratio = factors[i, k]
            if ratio != 0.0:
                for j in range(columns):
                    X[i, j] -= ratio * X[k, j]
    for k in range(n - 1, -1, -1):
        for i in range(k + 1, n):
            ratio = factors[k, i]
            if ratio != 0.0:
                for j in range(columns):
                    X[k, j] -= ratio * X[i, j]
        for j in range(columns):
            X[k, j] /= factors[k, k]


@part
def solve_pivoted(A: Array, b: Array, n: int) -> bool:
    """The first n of b (m,) become the solution of A y = b; False where A (m, m) is singular.

    Overwrites the first n rows and columns of A.
    """
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(A[i, k]) > abs(A[best, k]):
                best = i
        if A[best, k] == 0.0:
            return False
        if best != k:
            b[k], b[best] = b[best], b[k]
            for j in range(k, n):
                A[k, j], A[best, j] = A[best, j], A[k, j]
        for i in range(k + 1, n):
            ratio = A[i, k] / A[k, k]
            if ratio != 0.0:
                for j in range(k + 1, n):
                    A[i, j] -= ratio * A[k, j]
                b[i] -= ratio * b[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            b[k] -= A[k, j] * b[j]
        b[k] /= A[k, k]
    return True
