"""Sparse NLP functions from small blocks: exact patterns, derivatives mapped over the nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import casadi as ca
import numpy as np

from kemba.ocp.functions.compiled import compiled
from kemba.ocp.functions.constants import parameterised
from kemba.ocp.functions.settings import Functions
from kemba.ocp.functions.signs import canonical_signs
from kemba.ocp.functions.vectorised import vectorised

Entries = tuple[ca.MX, np.ndarray, np.ndarray]  # nonzeros, their rows, their columns


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

    def parameterised(self, p: ca.SX) -> Block:
        """The same with its numbers as constants, so that others can share its code, and mirrored
        halves written once."""
        (f, g), constants, numbers = parameterised([self.z, p], [self.f, ca.densify(self.g)])
        f, g = canonical_signs([self.z, p, constants], [f, g])
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

    `nlp`, `grad_f`, `jac_g`, `hess_lag` are what `ca.nlpsol` asks for, made when first asked for,
    as compiled code where `worth_compiling` (many solves ahead); `g`: (x, p) -> (rows,).
    """

    def __init__(
        self, blocks: Sequence[Block], size: int, p: ca.SX, worth_compiling: bool = False
    ) -> None:
        self.blocks = [b.parameterised(p) for b in blocks] if worth_compiling else list(blocks)
        self.size, self.p, self.worth_compiling = size, p, worth_compiling
        self.rows = sum(len(b.columns) * b.g.numel() for b in blocks)
        self.x, self.parameter = ca.MX.sym("x", size), ca.MX.sym("p", p.numel())

    @cached_property
    def g(self) -> ca.Function:
        """(x, p) -> every row."""
        rows = [_repeated(b, _value(b, self.p))(*self._local(b)) for b in self.blocks]
        at = [self.x, self.parameter]
        return ca.Function("g", at, [ca.vertcat(*map(ca.vec, rows))], ["x", "p"], ["g"])

    @cached_property
    def nlp(self) -> dict[str, ca.MX]:
        """x, p, f and g as expressions."""
        f, g = ca.MX(0), []
        for block, (cost, value, *_) in zip(self.blocks, self._functions, strict=True):
            here = self._local(block)
            f += ca.sum2(cost(*here))
            g.append(ca.vec(value(*here)))
        return {"x": self.x, "p": self.parameter, "f": f, "g": ca.vertcat(*g)}

    @cached_property
    def grad_f(self) -> ca.Function:
        """(x, p) -> f and its gradient."""
        f, gradients = ca.MX(0), []
        for block, (_, _, slope, _, _) in zip(self.blocks, self._functions, strict=True):
            cost, gradient = slope(*self._local(block))
            f += ca.sum2(cost)
            gradients.append((ca.vec(gradient), block.columns.ravel()))
        return self._named("grad_f", [f, _gather_gradient(gradients, self.size)], "f", "grad_f_x")

    @cached_property
    def jac_g(self) -> ca.Function:
        """(x, p) -> g and its Jacobian."""
        g, parts, row = [], [], 0
        for block, (_, _, _, first, _) in zip(self.blocks, self._functions, strict=True):
            values, nonzeros = first(*self._local(block))
            g.append(ca.vec(values))
            parts.append(_place_jacobian(block, nonzeros, row))
            row += values.numel()
        jacobian = _scatter(parts, self.rows, self.size)
        return self._named("jac_g", [ca.vertcat(*g), jacobian], "g", "jac_g_x")

    @cached_property
    def hess_lag(self) -> ca.Function:
        """(x, p, lam_f, lam_g) -> upper triangle of the Lagrangian's Hessian."""
        lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", self.rows)
        parts, row = [], 0
        for block, (*_, second) in zip(self.blocks, self._functions, strict=True):
            m, n = block.g.numel(), len(block.columns)
            multipliers = ca.reshape(lam_g[row : row + m * n], m, n)
            nonzeros = second(*self._local(block), lam_f, multipliers)
            parts.append(_place_hessian(block, nonzeros))
            row += m * n
        at = {"x": self.x, "p": self.parameter, "lam_f": lam_f, "lam_g": lam_g}
        hessian = _scatter(parts, self.size, self.size)
        result = ["triu_hess_gamma_x_x"]
        return ca.Function("hess_lag", list(at.values()), [hessian], list(at), result)

    def _named(self, name: str, results: list[ca.MX], *names: str) -> ca.Function:
        return ca.Function(name, [self.x, self.parameter], results, ["x", "p"], list(names))

    def _local(self, block: Block) -> tuple[ca.MX, ca.MX]:
        """Local variables of every repeat, side by side; parameters and constants of all."""
        given = ca.vertcat(self.parameter, ca.DM(block.numbers))
        return _gather(self.x, block.columns), given

    @cached_property
    def _functions(self) -> list[list[ca.Function]]:
        """Of every block, over its repeats: see `_functions`."""
        made = [_functions(b, self.p, self.worth_compiling) for b in self.blocks]
        return [[_repeated(b, f) for f in fs] for b, fs in zip(self.blocks, made, strict=True)]


def _gather(x: ca.MX, columns: np.ndarray) -> ca.MX:
    index = columns.ravel().tolist()
    return ca.reshape(x[index], columns.shape[1], columns.shape[0])


def _value(block: Block, p: ca.SX) -> ca.Function:
    rows = ca.cse(ca.densify(block.g))
    return ca.Function("value", [block.z, ca.vertcat(p, block.constants)], [rows])


def _functions(block: Block, p: ca.SX, worth_compiling: bool) -> list[ca.Function]:
    """Of one repeat: cost, rows, the cost's slope, the rows' Jacobian, the Lagrangian's Hessian."""
    z, f, g = block.z, block.f, ca.densify(block.g)
    at = [z, ca.vertcat(p, block.constants)]
    plain = [ca.Function("cost", at, [ca.cse(f)]), _value(block, p)]
    functions = [
        ca.Function("slope", at, ca.cse([f, ca.densify(ca.gradient(f, z))])),
        ca.Function("first", at, ca.cse([g, _column(block.jacobian)])),
        ca.Function("second", [*at, *block.multipliers], ca.cse([_column(block.hessian)])),
    ]
    large = functions[-1].n_instructions() > Functions.current().large
    return plain + (compiled(functions) if worth_compiling and large else functions)


def _repeated(block: Block, function: ca.Function) -> ca.Function:
    """(z side by side, parameters and constants; lam_f, lam_g side by side) -> results alike."""
    shared = [1, 2] if function.n_in() > 2 else [1]
    return vectorised(function, len(block.columns), shared)


def _gather_gradient(parts: list[tuple[ca.MX, np.ndarray]], size: int) -> ca.MX:
    where = np.concatenate([at for _, at in parts])
    return ca.densify(ca.mtimes(_adding(where, size), ca.vertcat(*(nz for nz, _ in parts))))


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
    pattern = ca.Sparsity.triplet(
        rows, columns, (places % rows).tolist(), (places // rows).tolist()
    )
    return ca.MX(pattern, ca.densify(ca.mtimes(_adding(target, len(places)), nonzeros)))


def _adding(target: np.ndarray, size: int) -> ca.DM:
    """The matrix that adds entry j of a vector to entry target[j] of one of `size`."""
    one_each = list(range(len(target) + 1))
    return ca.DM.ones(ca.Sparsity(size, len(target), one_each, target.tolist()))
