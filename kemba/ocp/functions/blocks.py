"""Sparse NLP functions from small blocks: exact patterns, derivatives mapped over the nodes."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from kemba.cache import Recent
from kemba.ocp.functions.code import Code, code_of
from kemba.ocp.functions.problem import derivative

Entries = tuple[ca.MX, np.ndarray, np.ndarray]  # nonzeros, their rows, their columns

PROBLEMS = 8  # programs kept for equal ones of the process: twice those of a continued plan


@dataclass(frozen=True)
class RowBlock:
    """Rows `g` (m,) and cost `f` of the local variables `z`, repeated over `columns`.

    `columns` (repeats, len(z)): where each repeat's local variables stand in the full vector.
    """

    z: ca.SX
    g: ca.SX
    f: ca.SX
    columns: np.ndarray


@dataclass(frozen=True)
class PlacedBlock:
    """The code of a block, and the `columns` (repeats, n) at which it is repeated."""

    code: Code
    columns: np.ndarray

    @property
    def functions(self) -> list[ca.Function]:
        """Cost, rows, slope, Jacobian and Hessian over all repeats."""
        return self.code.at(len(self.columns))


class BlockProblem:
    """min sum f, g stacked block by block, with Jacobian and Hessian given exactly.

    `nlp`, `grad_f`, `jac_g`, `hess_lag` are what `ca.nlpsol` asks for, made when first asked for,
    `g`: (x, p) -> (rows,).
    """

    def __init__(self, blocks: Sequence[PlacedBlock], size: int, parameters: int) -> None:
        self.blocks, self.size = list(blocks), size
        self.rows = sum(len(b.columns) * b.code.g.numel() for b in blocks)
        self.x, self.parameter = ca.MX.sym("x", size), ca.MX.sym("p", parameters)

    @cached_property
    def g(self) -> ca.Function:
        """(x, p) -> every row."""
        each = zip(self.blocks, self._locals, strict=True)
        rows = [b.code.rows_at(len(b.columns))(*here) for b, here in each]
        at = [self.x, self.parameter]
        return ca.Function("g", at, [ca.vertcat(*map(ca.vec, rows))], ["x", "p"], ["g"])

    @cached_property
    def nlp(self) -> dict[str, ca.MX]:
        """x, p, f and g as expressions."""
        f, g = ca.MX(0), []
        for _, here, (cost, value, *_) in self._each:
            f += ca.sum2(cost(*here))
            g.append(ca.vec(value(*here)))
        return {"x": self.x, "p": self.parameter, "f": f, "g": ca.vertcat(*g)}

    @cached_property
    def grad_f(self) -> ca.Function:
        """(x, p) -> f and its gradient."""
        f, gradients = ca.MX(0), []
        for block, here, (_, _, slope, _, _) in self._each:
            cost, gradient = slope(*here)
            f += ca.sum2(cost)
            gradients.append((ca.vec(gradient), block.columns.ravel()))
        where = np.concatenate([at for _, at in gradients])
        gathered = ca.mtimes(_adding(where, self.size), ca.vertcat(*(g for g, _ in gradients)))
        return derivative("grad_f", [self.x, self.parameter], [f, ca.densify(gathered)])

    @cached_property
    def jac_g(self) -> ca.Function:
        """(x, p) -> g and its Jacobian."""
        g, parts, row = [], [], 0
        for block, here, (_, _, _, first, _) in self._each:
            values, nonzeros = first(*here)
            g.append(ca.vec(values))
            parts.append(_place_jacobian(block, nonzeros, row))
            row += values.numel()
        jacobian = _scatter(parts, self.rows, self.size)
        return derivative("jac_g", [self.x, self.parameter], [ca.vertcat(*g), jacobian])

    @cached_property
    def hess_lag(self) -> ca.Function:
        """(x, p, lam_f, lam_g) -> upper triangle of the Lagrangian's Hessian."""
        lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", self.rows)
        parts, row = [], 0
        for block, here, (*_, second) in self._each:
            m, n = block.code.g.numel(), len(block.columns)
            multipliers = ca.reshape(lam_g[row : row + m * n], m, n)
            nonzeros = second(*here, lam_f, multipliers)
            parts.append(_place_hessian(block, nonzeros))
            row += m * n
        hessian = _scatter(parts, self.size, self.size)
        return derivative("hess_lag", [self.x, self.parameter, lam_f, lam_g], [hessian])

    @cached_property
    def _locals(self) -> list[tuple[ca.MX, ca.MX]]:
        """Of every block the local variables of its repeats, side by side; and parameters and
        constants of all of them."""
        return [
            (_gather(self.x, b.columns), ca.vertcat(self.parameter, ca.DM(b.code.numbers)))
            for b in self.blocks
        ]

    @cached_property
    def _each(self) -> list[tuple[PlacedBlock, tuple[ca.MX, ca.MX], list[ca.Function]]]:
        """Every block, its local variables, and its functions over its repeats."""
        each = zip(self.blocks, self._locals, strict=True)
        return [(block, here, block.functions) for block, here in each]


_kept: Recent[tuple[object, ...], BlockProblem] = Recent()  # by code and columns


def block_problem(
    blocks: Sequence[RowBlock], size: int, p: ca.SX, shared: bool = False
) -> BlockProblem:
    """The problem of `blocks` in `size` variables, with parameters p.

    `shared`: many solves are ahead. Then a problem that differs from an earlier one of the process
    by bounds only, such as a jump to another height, is that one.
    """
    codes = [code_of(b.z, p, b.f, b.g, shared) for b in blocks]
    placed = [PlacedBlock(c, b.columns) for c, b in zip(codes, blocks, strict=True)]

    def make() -> BlockProblem:
        return BlockProblem(placed, size, p.numel())

    parts = ((b.code, b.columns.shape, b.columns.tobytes()) for b in placed)
    key = (size, p.numel(), *parts)
    return _kept.get(key, make, PROBLEMS) if shared else make()


def _gather(x: ca.MX, columns: np.ndarray) -> ca.MX:
    index = columns.ravel().tolist()
    return ca.reshape(x[index], columns.shape[1], columns.shape[0])


def _place_jacobian(block: PlacedBlock, nonzeros: ca.MX, row: int) -> Entries:
    rows, columns = (np.array(t, dtype=int) for t in block.code.jacobian.sparsity().get_triplet())
    repeats = np.arange(len(block.columns))[:, None]
    at_rows = (row + repeats * block.code.g.numel() + rows).ravel()
    return ca.vec(nonzeros), at_rows, block.columns[:, columns].ravel()


def _place_hessian(block: PlacedBlock, nonzeros: ca.MX) -> Entries:
    rows, columns = (np.array(t, dtype=int) for t in block.code.hessian.sparsity().get_triplet())
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
