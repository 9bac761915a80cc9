"""The functions of a block, with exact derivatives; equal blocks of one process share them.

A plan is found with several programs: coarse and fine grids, half and whole robot, two schemes.
Most of their blocks are the same expressions at other places. Differentiating and rewriting them is
most of the time of building a program, so it is done once for each expression.
"""

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property

import casadi as ca
import numpy as np

from kemba.cache import Recent
from kemba.instructions import replay
from kemba.ocp.functions.signs import canonical_signs
from kemba.settings import Settings, setting

FEW = 8  # points at which evaluating one by one is as fast as all at once


class Functions(Settings):
    """How the functions for IPOPT are made."""

    kept: int = setting(
        400, "1", "blocks whose functions are kept for the next program of the process",
        "convention: twice the blocks of all programs of a jump",
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Code:
    """Rows `g` (m,) and cost `f` of the local variables `z` (n,) and of what is `given` (k,).

    `given` are the parameters of the problem, then the constants with the values `numbers`.
    """

    z: ca.SX
    given: ca.SX
    f: ca.SX
    g: ca.SX
    numbers: np.ndarray
    _mapped: dict[tuple[int, str], list[ca.Function]] = field(default_factory=dict)

    @cached_property
    def multipliers(self) -> tuple[ca.SX, ca.SX]:
        """Symbols of the Lagrangian's multipliers: of f a scalar, of g a vector (m,)."""
        return ca.SX.sym("lam_f"), ca.SX.sym("lam_g", self.g.numel())

    @cached_property
    def jacobian(self) -> ca.SX:
        """Jacobian matrix (m, n) of g by z."""
        return ca.jacobian(self.g, self.z)

    @cached_property
    def hessian(self) -> ca.SX:
        """Upper triangle, a matrix (n, n), of the Lagrangian's Hessian by z."""
        lam_f, lam_g = self.multipliers
        return ca.triu(ca.hessian(lam_f * self.f + ca.dot(lam_g, self.g), self.z)[0])

    @cached_property
    def value(self) -> ca.Function:
        """The rows: (z, given) -> g."""
        return ca.Function("value", [self.z, self.given], [ca.cse(self.g)])

    def rows_at(self, points: int) -> ca.Function:
        """`value` at `points` side by side."""
        return self._at(points, "value", [self.value])[0]

    def at(self, points: int) -> list[ca.Function]:
        """At `points` side by side: cost, rows, the cost's slope, the rows' Jacobian, the
        Lagrangian's Hessian; see `_functions` for one point."""
        return self._at(points, "all", self._functions)

    def _at(self, points: int, name: str, functions: list[ca.Function]) -> list[ca.Function]:
        if (points, name) not in self._mapped:
            shared = [[1, 2] if f.n_in() > 2 else [1] for f in functions]
            made = [vectorised(f, points, s) for f, s in zip(functions, shared, strict=True)]
            self._mapped[points, name] = made
        return self._mapped[points, name]

    @cached_property
    def _functions(self) -> list[ca.Function]:
        z, f, g = self.z, self.f, self.g
        at = [z, self.given]
        return [
            ca.Function("cost", at, [ca.cse(f)]),
            self.value,
            ca.Function("slope", at, ca.cse([f, ca.densify(ca.gradient(f, z))])),
            ca.Function("first", at, ca.cse([g, _column(self.jacobian)])),
            ca.Function("second", [*at, *self.multipliers], ca.cse([_column(self.hessian)])),
        ]


_kept: Recent[str, Code] = Recent()  # by the text of a block's functions


def code_of(z: ca.SX, p: ca.SX, f: ca.SX, g: ca.SX, shared: bool) -> Code:
    """The code of cost f and rows g of z and parameters p.

    Where it is `shared`, constants become parameters, so that blocks which differ in numbers are
    equal, and parts that differ only in sign are written once; the code of an equal block is used
    again.
    """
    g = ca.densify(g)
    if not shared:
        return Code(z, p, f, g, np.zeros(0))
    text = ca.Function("block", [z, p], [f, g]).serialize()
    return _kept.get(text, lambda: _rewritten(z, p, f, g), Functions.current().kept)


def _rewritten(z: ca.SX, p: ca.SX, f: ca.SX, g: ca.SX) -> Code:
    (f, g), constants, numbers = parameterised([z, p], [f, g])
    f, g = canonical_signs([z, p, constants], [f, g])
    return Code(z, ca.vertcat(p, constants), f, g, numbers)


def _column(matrix: ca.SX) -> ca.SX:
    """Nonzeros as a dense column, so that mapped outputs line up."""
    return ca.SX(matrix.nz[:]) if matrix.nnz() else ca.SX(0, 1)


SHAPING = (-1.0, 0.0, 0.5, 1.0, 2.0)  # CasADi simplifies expressions with these numbers


def parameterised(
    inputs: Sequence[ca.SX], outputs: Sequence[ca.SX]
) -> tuple[list[ca.SX], ca.SX, np.ndarray]:
    """The dense outputs with a symbol (k,) for their distinct constants, and the values (k,)."""
    f = ca.Function("f", list(inputs), list(outputs))
    given = [ca.vertsplit(ca.vec(ca.densify(x))) for x in inputs]
    symbols: dict[float, ca.SX] = {}

    def number(value: float) -> ca.SX:
        if value in SHAPING:
            return ca.SX(value)
        return symbols.setdefault(value, ca.SX.sym(f"c{len(symbols)}"))

    def apply(kind: int, *operands: ca.SX) -> ca.SX:
        return (ca.SX.unary if len(operands) == 1 else ca.SX.binary)(kind, *operands)

    found = replay(f, given, number, apply)
    results = [ca.SX.zeros(f.sparsity_out(i)) for i in range(f.n_out())]
    for result, nonzeros in zip(results, found, strict=True):
        result.nz[:] = ca.vertcat(*nonzeros)
    return results, ca.vertcat(*symbols.values()), np.array(list(symbols))


def vectorised(f: ca.Function, points: int, shared: Collection[int] = ()) -> ca.Function:
    """f of SX at `points` at once: its inputs (n, points), except the `shared` ones (n,), which
    are the same at all; dense outputs (m, points). Equal to f at every point to the last bit."""
    if points < FEW or f.class_name() != "SXFunction":
        return f.map(f.name(), "serial", points, list(shared), [])
    widths = [1 if i in shared else points for i in range(f.n_in())]
    inputs = [ca.MX.sym(f.name_in(i), f.numel_in(i), w) for i, w in enumerate(widths)]
    with _as_written():
        rows = [ca.vertsplit(x) if x.numel() else [] for x in inputs]
        outputs = replay(f, [[row.T for row in group] for group in rows], ca.MX, _apply)
        stacked = [_stacked(found, points) for found in outputs]
        return ca.Function(f.name(), inputs, stacked, {"never_inline": True})


def _apply(kind: int, *operands: ca.MX) -> ca.MX:
    if len(operands) == 1:
        return ca.MX.unary(kind, operands[0])
    return ca.MX.binary(kind, operands[0], operands[1])


def _stacked(elements: list[ca.MX], points: int) -> ca.MX:
    """Elements (points,), or scalars that are the same at all, as rows."""
    rows = [e if e.numel() == points else ca.repmat(e, points) for e in elements]
    return ca.horzcat(*rows).T if rows else ca.MX(0, points)


@contextmanager
def _as_written() -> Iterator[None]:
    """Without CasADi's simplifications, which may change the rounding."""
    before = ca.GlobalOptions.getSimplificationOnTheFly()
    ca.GlobalOptions.setSimplificationOnTheFly(False)
    try:
        yield
    finally:
        ca.GlobalOptions.setSimplificationOnTheFly(before)
