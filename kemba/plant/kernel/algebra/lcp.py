"""Small linear complementarity problems: 0 <= z _|_ w = A z + b >= 0.

Contact modes rarely change from one step to the next, so the last one is tried first; Lemke's
method (lexicographic, hence finite for contact with friction: Stewart and Trinkle, 1996) answers
where that fails.
"""

from __future__ import annotations

from kemba.plant.kernel.algebra.lemke import lemke
from kemba.plant.kernel.algebra.linear import solve_pivoted
from kemba.plant.kernel.jit import kernel, part
from kemba.plant.kernel.machine import Lcp
from kemba.plant.kernel.settings import Complementarity

ROUNDING, SWAPS = Complementarity.current().rounding, Complementarity.current().swaps


@kernel
def solve_lcp(w: Lcp, n: int) -> None:
    """Solution z and active set of the first n unknowns, starting from the active set `w.on`.

    Raises NoSolutionError.
    """
    for attempt in range(2):
        if attempt == 1:
            for i in range(n):
                w.on[i] = False
        for _ in range(SWAPS):
            if not _try_active_set(w, n):
                break
            if not _corrected(w, n):
                for i in range(n):
                    w.z[i] = max(w.z[i], 0.0)
                return
    by_lemke(w, n)


@kernel
def _try_active_set(w: Lcp, n: int) -> bool:
    """The z that the active set gives, or False where it gives none."""
    size = 0
    for i in range(n):
        w.z[i] = 0.0
        if w.on[i]:
            w.places[size] = i
            size += 1
    for i in range(size):
        w.right[i] = -w.b[w.places[i]]
        for j in range(size):
            w.inner[i, j] = w.A[w.places[i], w.places[j]]
    if not solve_pivoted(w.inner, w.right, size):
        return False
    for i in range(size):
        w.z[w.places[i]] = w.right[i]
    return True


@part
def _corrected(w: Lcp, n: int) -> bool:
    """Move every unknown that is on the wrong side to the other; whether there was one."""
    changed, largest = False, 0.0
    for i in range(n):
        largest = max(largest, abs(w.z[i]))
    for i in range(n):
        slack, terms = w.b[i], abs(w.b[i])
        for j in range(n):
            term = w.A[i, j] * w.z[j]
            slack += term
            terms += abs(term)
        wrong = w.z[i] < -ROUNDING * largest if w.on[i] else slack < -ROUNDING * terms
        if wrong:
            w.on[i] = not w.on[i]
            changed = True
    return changed


@kernel
def by_lemke(w: Lcp, n: int) -> None:
    """Lemke's method, with rows and columns scaled so that forces and slip speeds compare: a force
    has a diagonal, a slip speed and its cone have none."""
    count, usual = 0, 0.0
    for i in range(n):
        if w.A[i, i] > 0.0:
            count, usual = count + 1, usual + w.A[i, i]
    usual = usual / count if count > 0 else 1.0
    for i in range(n):
        row = usual / w.A[i, i] if w.A[i, i] > 0.0 else usual
        for j in range(n):
            column = 1.0 / usual if w.A[j, j] > 0.0 else 1.0
            w.table[i, j] = 1.0 if i == j else 0.0
            w.table[i, n + j] = -row * w.A[i, j] * column
        w.table[i, 2 * n] = -1.0
        w.table[i, 2 * n + 1] = row * w.b[i]
    lemke(w, n)
    for i in range(n):
        w.z[i] = 0.0
    for i in range(n):
        j = w.basis[i] - n
        if 0 <= j < n:
            w.z[j] = max(w.table[i, 2 * n + 1], 0.0)
            w.z[j] *= 1.0 / usual if w.A[j, j] > 0.0 else 1.0
    for i in range(n):
        w.on[i] = w.z[i] > 0.0
