"""The optimality conditions of a multi-phase program, differentiated at its solution.

With f, g and multipliers lam, mu, the Lagrangian is L = f + lam g + mu x. A change of a figure
changes its gradient, the rows and the bounds; variables and multipliers answer by

    [ W + S   J^T ] [ dx   ]   [ -d(grad L) + S d(bound of x) ]
    [ J       -D  ] [ dlam ] = [ -d g + d(bound of g)         ]

S = mu / (distance to the bound) is large where a bound of x is active and zero elsewhere;
D = (distance to the bound) / lam is zero for equalities and large where a row is not active.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from kemba.ocp.nlp.ipopt import Iterate
from kemba.ocp.phases.program import PhasePart, PhaseProgram

Vector = np.ndarray


NEAR = 1e-10  # scaled distance from a bound below which it is touched: IPOPT's is 1e-8
OFF = 1e-9  # least multiplier of a row, by which distances are divided: such a row is not active
SOFT = 1e-9  # on the diagonal, against rows that say the same: far below the entries, about one


@dataclass(frozen=True)
class Change:
    """What a change of a figure does to a program at a point, all else kept.

    To the cost f, the gradient of the Lagrangian (n,), the rows g (m,) and all bounds.
    """

    f: float
    gradient: Vector
    g: Vector
    lower: Vector
    upper: Vector
    g_lower: Vector
    g_upper: Vector


def change_between(low: PhaseProgram, high: PhaseProgram, point: Iterate) -> Change | None:
    """The program `high` less `low` at a point, which may have variables of its own behind theirs.

    None where their rows do not correspond.
    """
    assert point.lam_g is not None
    if len(low.parts) != len(high.parts) or len(low.rows) != len(high.rows):
        return None
    x = point.Y[: low.columns.size]
    f, gradient, g, row = 0.0, np.zeros(len(x)), np.zeros(len(low.rows)), 0
    for old, new in zip(low.parts, high.parts, strict=True):
        n, m = len(old.columns), old.g.numel()
        if (n, m) != (len(new.columns), new.g.numel()):
            return None
        rows = slice(row, row + n * m)
        row += n * m
        if _text(old) == _text(new):
            continue
        at = x[old.columns].T, point.lam_g[rows].reshape(n, m).T
        before, after = (_evaluated(part, n)(*at) for part in (old, new))
        cost, value, slope = (np.array(b) - np.array(a) for a, b in zip(before, after, strict=True))
        f += float(cost.sum())
        g[rows] = value.T.ravel()
        np.add.at(gradient, old.columns.ravel(), slope.T.ravel())
    bounds = ("lower", "upper", "g_lower", "g_upper")
    return Change(f, gradient, g, *(_less(getattr(high, b), getattr(low, b)) for b in bounds))


def _text(part: PhasePart) -> str:
    return str(ca.Function("part", [part.z], [part.f, part.g]).serialize())


def _evaluated(part: PhasePart, repeats: int) -> ca.Function:
    """(z, multipliers) -> cost, rows, gradient of the Lagrangian; for all repeats side by side."""
    weights = ca.SX.sym("weights", part.g.numel())
    total = part.f + ca.dot(weights, ca.densify(part.g))
    results = [ca.densify(part.f), ca.densify(part.g), ca.densify(ca.gradient(total, part.z))]
    return ca.Function("part", [part.z, weights], ca.cse(results)).map(repeats)


def _less(high: Vector, low: Vector) -> Vector:
    """The difference; of equal infinite bounds it is 0."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.nan_to_num(high - low))


@dataclass(frozen=True)
class Kkt:
    """The factorised matrix of a solution: `solver` of free variables and rows.

    `free` (n,): variables that may move; `pull` (n,): S; `lam` (m,), `mu` (n,): multipliers;
    `fixed`: columns of W and J of the variables that are fixed; `slope` (n,): gradient of the cost.
    """

    solver: Any
    free: np.ndarray
    pull: Vector
    lam: Vector
    mu: Vector
    fixed: Any
    slope: Vector

    @classmethod
    def of(cls, program: PhaseProgram, point: Iterate) -> Kkt:
        """The system of a program at its solution."""
        from scipy import sparse
        from scipy.sparse.linalg import splu

        assert point.lam_g is not None
        assert point.lam_x is not None
        x, lam, mu = point.Y, point.lam_g, point.lam_x
        problem = program.problem
        half = _sparse(problem.hess_lag(x, [], 1.0, lam))
        g, jacobian = problem.jac_g(x, [])
        g, J = np.array(g).ravel(), _sparse(jacobian)
        W = half + sparse.triu(half, 1).T
        free = program.lower < program.upper
        pull = np.abs(mu) / np.maximum(_distance(x, mu, program.lower, program.upper), NEAR)
        away = _distance(g, lam, program.g_lower, program.g_upper)
        equal = program.g_lower == program.g_upper
        loose = np.where(equal, SOFT, away / np.maximum(np.abs(lam), OFF) + SOFT)
        both = sparse.vstack([W, J]).tocsc()
        matrix = sparse.bmat(
            [
                [W[free][:, free] + sparse.diags(pull[free] + SOFT), J[:, free].T],
                [J[:, free], -sparse.diags(loose)],
            ]
        )
        slope = np.array(problem.grad_f(x, [])[1]).ravel()
        return cls(splu(matrix.tocsc()), free, pull, lam, mu, both[:, ~free], slope)

    def answer(self, change: Change) -> Vector:
        """The change (n,) of the variables that a change of the program asks for."""
        n = len(self.free)
        moved = _padded(np.where(self.mu[: len(change.upper)] > 0, change.upper, change.lower), n)
        bound = np.where(self.lam > 0, change.g_upper, change.g_lower)
        right = np.concatenate(
            [(self.pull * moved - _padded(change.gradient, n))[self.free], bound - change.g]
        )
        given = self.fixed @ moved[~self.free]
        right -= np.concatenate([given[:n][self.free], given[n:]])
        dx: Vector = moved.copy()
        dx[self.free] = self.solver.solve(right)[: self.free.sum()]
        return dx


def _padded(values: Vector, size: int) -> Vector:
    """Values with zeros behind them: the program may have proximal variables."""
    return np.concatenate([values, np.zeros(size - len(values))])


def _distance(values: Vector, multiplier: Vector, lower: Vector, upper: Vector) -> Vector:
    """How far values are from the bound that their multiplier is about."""
    return np.asarray(np.abs(np.where(multiplier > 0, upper - values, values - lower)))


def _sparse(matrix: ca.DM) -> Any:
    from scipy.sparse import csc_matrix

    starts, rows = matrix.sparsity().get_ccs()
    return csc_matrix((matrix.nonzeros(), rows, starts), shape=matrix.shape)
