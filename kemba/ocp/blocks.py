"""Sparse NLP functions from small blocks: exact patterns, derivatives mapped over the nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import casadi as ca
import numpy as np
from scipy import sparse

from kemba.ocp.compiled import compiled
from kemba.ocp.lifted import lifted

Entries = tuple[ca.MX, np.ndarray, np.ndarray]  # nonzeros, their rows, their columns

LARGE = 1000  # instructions of a Hessian block that make compiling worth while


@dataclass(frozen=True)
class Block:
    """Rows `g` (m,) and cost `f` of the local variables `z`, repeated over `columns`.

    `columns` (repeats, len(z)): where each repeat's local variables stand in the full vector.
    `constants` (k,): symbols in g and f that stand for `numbers` (k,).
    """

    z: ca.SX
    g: ca.SX
    f: ca.SX
    columns: np.ndarray
    constants: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    numbers: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def lifted(self, p: ca.SX) -> Block:
        """The same with its numbers as constants, so that others can share its code."""
        (f, g), constants, numbers = lifted([self.z, p], [self.f, ca.densify(self.g)])
        return replace(self, g=g, f=f, constants=constants, numbers=numbers)

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

    Functions of (x, p): `g`, `grad_f`, `jac_g`, `hess_lag`, ready for `ca.nlpsol`; the derivatives
    are made when first asked for, as compiled code where `worth_compiling` (many solves ahead).
    """

    def __init__(
        self, blocks: Sequence[Block], size: int, p: ca.SX, worth_compiling: bool = False
    ) -> None:
        self.blocks = [b.lifted(p) for b in blocks] if worth_compiling else list(blocks)
        self.size, self.p, self.worth_compiling = size, p, worth_compiling
        self.rows = sum(len(b.columns) * b.g.numel() for b in blocks)
        x, parameter = ca.MX.sym("x", size), ca.MX.sym("p", p.numel())
        self.x, self.parameter = x, parameter
        f, g = ca.MX(0), []
        for block in self.blocks:
            at, rows = [block.z, ca.vertcat(p, block.constants)], ca.densify(block.g)
            value = ca.Function("value", at, ca.cse([block.f, rows])).map(len(block.columns))
            cost, values = value(*self._local(block))
            f += ca.sum2(cost)
            g.append(ca.vec(values))
        self.nlp = {"x": x, "p": parameter, "f": f, "g": ca.vertcat(*g)}
        self.g = ca.Function("g", [x, parameter], [self.nlp["g"]], ["x", "p"], ["g"])

    def _local(self, block: Block) -> tuple[ca.MX, ca.MX]:
        """Local variables, parameters and constants of every repeat, side by side."""
        given = ca.vertcat(self.parameter, ca.DM(block.numbers))
        return _gather(self.x, block.columns), ca.repmat(given, 1, len(block.columns))

    @cached_property
    def grad_f(self) -> ca.Function:
        """(x, p) -> f and its gradient."""
        return self._derivatives[0]

    @cached_property
    def jac_g(self) -> ca.Function:
        """(x, p) -> g and its Jacobian."""
        return self._derivatives[1]

    @cached_property
    def hess_lag(self) -> ca.Function:
        """(x, p, lam_f, lam_g) -> upper triangle of the Lagrangian's Hessian."""
        return self._derivatives[2]

    @cached_property
    def _derivatives(self) -> tuple[ca.Function, ca.Function, ca.Function]:
        lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", self.rows)
        f, gradients, g = ca.MX(0), [], []
        jac: list[Entries] = []
        hess: list[Entries] = []
        row = 0
        for block in self.blocks:
            m, n = block.g.numel(), len(block.columns)
            here = self._local(block)
            functions = _functions(block, self.p, self.worth_compiling)
            slope_of, first, second = (function.map(n) for function in functions)
            cost, slope = slope_of(*here)
            f += ca.sum2(cost)
            gradients.append((ca.vec(slope), block.columns.ravel()))
            values, j_block = first(*here)
            g.append(ca.vec(values))
            multipliers = ca.reshape(lam_g[row : row + m * n], m, n)
            h_block = second(*here, ca.repmat(lam_f, 1, n), multipliers)
            jac.append(_place_jacobian(block, j_block, row))
            hess.append(_place_hessian(block, h_block))
            row += m * n
        names, at = ["x", "p"], [self.x, self.parameter]
        gradient = _gather_gradient(gradients, self.size)
        jacobian = [ca.vertcat(*g), _scatter(jac, self.rows, self.size)]
        hessian = [_scatter(hess, self.size, self.size)]
        return (
            ca.Function("grad_f", at, [f, gradient], names, ["f", "grad_f_x"]),
            ca.Function("jac_g", at, jacobian, names, ["g", "jac_g_x"]),
            ca.Function(
                "hess_lag",
                [*at, lam_f, lam_g],
                hessian,
                [*names, "lam_f", "lam_g"],
                ["triu_hess_gamma_x_x"],
            ),
        )


def _gather(x: ca.MX, columns: np.ndarray) -> ca.MX:
    index = columns.ravel().tolist()
    return ca.reshape(x[index], columns.shape[1], columns.shape[0])


def _functions(block: Block, p: ca.SX, worth_compiling: bool) -> list[ca.Function]:
    """Of one repeat: the cost's slope, the rows' Jacobian, the Lagrangian's Hessian."""
    z, f, g = block.z, block.f, ca.densify(block.g)
    at = [z, ca.vertcat(p, block.constants)]
    functions = [
        ca.Function("slope", at, ca.cse([f, ca.densify(ca.gradient(f, z))])),
        ca.Function("first", at, ca.cse([g, _column(block.jacobian)])),
        ca.Function("second", [*at, *block.multipliers], ca.cse([_column(block.hessian)])),
    ]
    large = functions[-1].n_instructions() > LARGE
    return compiled(functions) if worth_compiling and large else functions


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
