"""Sparse NLP functions from small blocks: exact patterns, derivatives mapped over the nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from scipy import sparse

from kemba.ocp.compiled import compiled

Entries = tuple[ca.MX, np.ndarray, np.ndarray]  # nonzeros, their rows, their columns

WORTH_COMPILING = 1000  # instructions of a Hessian block


@dataclass(frozen=True)
class Block:
    """Rows `g` (m,) and cost `f` of the local variables `z`, repeated over `columns`.

    `columns` (repeats, len(z)): where each repeat's local variables stand in the full vector.
    """

    z: ca.SX
    g: ca.SX
    f: ca.SX
    columns: np.ndarray

    @cached_property
    def multipliers(self) -> tuple[ca.SX, ca.SX]:
        """Symbols of the Lagrangian: of f and of g."""
        return ca.SX.sym("lam_f"), ca.SX.sym("lam_g", self.g.numel())

    @cached_property
    def jacobian(self) -> ca.SX:
        return ca.jacobian(self.g, self.z)

    @cached_property
    def hessian(self) -> ca.SX:
        """Upper triangle of the Lagrangian's Hessian."""
        lam_f, lam_g = self.multipliers
        return ca.triu(ca.hessian(lam_f * self.f + ca.dot(lam_g, ca.densify(self.g)), self.z)[0])


class BlockProblem:
    """min sum f, g stacked block by block, with Jacobian and Hessian given exactly.

    Functions of (x, p): `f`, `grad_f`, `g`, `jac_g`, `hess_lag`, ready for `ca.nlpsol`.
    """

    def __init__(self, blocks: Sequence[Block], size: int, p: ca.SX) -> None:
        self.blocks, self.size, self.p = list(blocks), size, p
        self.rows = sum(len(b.columns) * b.g.numel() for b in blocks)
        x, parameter = ca.MX.sym("x", size), ca.MX.sym("p", p.numel())
        lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", self.rows)
        self.x, self.parameter = x, parameter
        f, total, gradients, g, again = ca.MX(0), ca.MX(0), [], [], []
        jac: list[Entries] = []
        hess: list[Entries] = []
        row = 0
        for block in blocks:
            m, n = block.g.numel(), len(block.columns)
            local, many = _gather(x, block.columns), ca.repmat(parameter, 1, n)
            value, slope_of, first, second = (f_.map(n) for f_ in _functions(block, p))
            cost, values = value(local, many)
            f += ca.sum2(cost)
            g.append(ca.vec(values))
            cost, slope = slope_of(local, many)
            total += ca.sum2(cost)
            values, j_block = first(local, many)
            again.append(ca.vec(values))
            gradients.append((ca.vec(slope), block.columns.ravel()))
            multipliers = ca.reshape(lam_g[row : row + m * n], m, n)
            h_block = second(local, many, ca.repmat(lam_f, 1, n), multipliers)
            jac.append(_place_jacobian(block, j_block, row))
            hess.append(_place_hessian(block, h_block))
            row += m * n
        stacked, repeated = ca.vertcat(*g), ca.vertcat(*again)
        jacobian = _scatter(jac, self.rows, size)
        hessian = _scatter(hess, size, size)
        gradient = _gather_gradient(gradients, size)
        self.nlp = {"x": x, "p": parameter, "f": f, "g": stacked}
        names, at = ["x", "p"], [x, parameter]
        self.grad_f = ca.Function("grad_f", at, [total, gradient], names, ["f", "grad_f_x"])
        self.jac_g = ca.Function("jac_g", at, [repeated, jacobian], names, ["g", "jac_g_x"])
        self.hess_lag = ca.Function(
            "hess_lag",
            [*at, lam_f, lam_g],
            [hessian],
            [*names, "lam_f", "lam_g"],
            ["triu_hess_gamma_x_x"],
        )
        self.g = ca.Function("g", at, [stacked], names, ["g"])


def _gather(x: ca.MX, columns: np.ndarray) -> ca.MX:
    index = columns.ravel().tolist()
    return ca.reshape(x[index], columns.shape[1], columns.shape[0])


def _functions(block: Block, p: ca.SX) -> list[ca.Function]:
    """Of one repeat: values, the cost's slope, the rows' Jacobian, the Lagrangian's Hessian."""
    z, f, g = block.z, block.f, ca.densify(block.g)
    value = ca.Function("value", [z, p], ca.cse([f, g]))
    derivatives = [
        ca.Function("slope", [z, p], ca.cse([f, ca.densify(ca.gradient(f, z))])),
        ca.Function("first", [z, p], ca.cse([g, _column(block.jacobian)])),
        ca.Function("second", [z, p, *block.multipliers], ca.cse([_column(block.hessian)])),
    ]
    if derivatives[-1].n_instructions() > WORTH_COMPILING:
        derivatives = compiled(derivatives)  # `value` stays: CasADi wants to differentiate it
    return [value, *derivatives]


def _gather_gradient(parts: list[tuple[ca.MX, np.ndarray]], size: int) -> ca.MX:
    where = np.concatenate([at for _, at in parts])
    entries = (np.ones(len(where)), (where, np.arange(len(where))))
    S = sparse.csc_matrix(entries, (size, len(where)))
    return ca.densify(ca.mtimes(_dm(S), ca.vertcat(*(nz for nz, _ in parts))))


def _column(matrix: ca.SX) -> ca.SX:
    """Nonzeros as a dense column, so that mapped outputs line up."""
    return ca.SX(matrix.nz[:]) if matrix.nnz() else ca.SX(0, 1)


def _place_jacobian(block: Block, nonzeros: ca.MX, row: int) -> Entries:
    rows, columns = (np.array(t, dtype=int) for t in block.jacobian.sparsity().get_triplet())
    repeats = np.arange(len(block.columns))[:, None]
    at_rows = (row + repeats * block.g.numel() + rows).ravel()
    return ca.vec(nonzeros), at_rows, block.columns[:, columns].ravel()


def _place_hessian(block: Block, nonzeros: ca.MX) -> Entries:
    rows, columns = (np.array(t, dtype=int) for t in block.hessian.sparsity().get_triplet())
    first, second = block.columns[:, rows].ravel(), block.columns[:, columns].ravel()
    return ca.vec(nonzeros), np.minimum(first, second), np.maximum(first, second)


def _scatter(parts: list[Entries], rows: int, columns: int) -> ca.MX:
    """A sparse matrix from nonzeros and their places; entries at one place add up."""
    nonzeros = ca.vertcat(*(nz for nz, _, _ in parts))
    key = np.concatenate([c.astype(np.int64) * rows + r for _, r, c in parts])
    places, target = np.unique(key, return_inverse=True)
    entries = (np.ones(len(key)), (target, np.arange(len(key))))
    S = sparse.csc_matrix(entries, (len(places), len(key)))
    pattern = ca.Sparsity.triplet(
        rows, columns, (places % rows).tolist(), (places // rows).tolist()
    )
    return ca.MX(pattern, ca.densify(ca.mtimes(_dm(S), nonzeros)))


def _dm(matrix: sparse.csc_matrix) -> ca.DM:
    rows, columns = matrix.shape
    pattern = ca.Sparsity(rows, columns, matrix.indptr.tolist(), matrix.indices.tolist())
    return ca.DM(pattern, matrix.data)
