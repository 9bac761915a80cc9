"""Small linear systems and complementarity problems: 0 <= z _|_ w = A z + b >= 0.

Contact modes rarely change from one step to the next, so the last one is tried first; Lemke's
method (lexicographic, hence finite for contact with friction: Stewart and Trinkle, 1996) answers
where that fails.
"""

from kemba.plant.kernel.jit import kernel, part
from kemba.plant.kernel.machine import Array, Lcp

# of a column's largest entry: a smaller one is no pivot (far above rounding errors)
NEGLIGIBLE = 1e-11
TIE = 1e-12  # ratios that differ by less are equal (far above rounding errors)
PIVOTS = 50  # pivots per unknown


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


ROUNDING = 1e-11  # of a row's terms: a smaller violation is none (far above rounding errors)
SWAPS = 6  # changes of the active set before Lemke's method takes over


@kernel
def solve_lcp(w: Lcp, n: int) -> None:
    """Solution z and active set of the first n unknowns, starting from the active set `w.on`.
    Raises NoSolutionError."""
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
