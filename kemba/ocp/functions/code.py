"""The functions of a block, with exact derivatives; equal blocks of one process share them.

A plan is found with several programs: coarse and fine grids, half and whole robot, two schemes.
Most of their blocks are the same expressions at other places. Differentiating and rewriting them is
most of the time of building a program, so it is done once for each expression.

What differs by a sign alone is written once, too. The sines and lever arms of a mirrored leg are
the negatives of the other leg's. CasADi does not see this and computes both. Here signs are moved
out of even and odd functions, products and sums, so that both legs share the same expressions.
Rounding does not change: IEEE arithmetic is symmetric.
"""

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from kemba.cache import Recent
from kemba.instructions import replay

EVEN = {ca.OP_COS, ca.OP_COSH, ca.OP_SQ, ca.OP_FABS}
ODD = {ca.OP_SIN, ca.OP_TAN, ca.OP_ASIN, ca.OP_ATAN, ca.OP_SINH, ca.OP_TANH, ca.OP_TWICE}
ODD |= {ca.OP_INV, ca.OP_SIGN, ca.OP_ERF, ca.OP_ASINH, ca.OP_ATANH}
SUMS = {ca.OP_ADD, ca.OP_SUB}

Signed = tuple[bool, ca.SX]  # whether negated, and of what


def canonical_signs(inputs: Sequence[ca.SX], outputs: Sequence[ca.SX]) -> list[ca.SX]:
    """The same outputs, dense, of symbols, with mirrored subexpressions shared."""
    f = ca.Function("f", list(inputs), [ca.densify(y) for y in outputs])
    given = [[(False, x) for x in ca.vertsplit(ca.vec(symbols))] for symbols in inputs]
    signed = _Canonical()
    found = replay(f, given, signed.number, signed.apply)
    elements = [ca.vertcat(*(_plain(x) for x in nonzeros)) for nonzeros in found]
    return [ca.reshape(ca.SX(e), y.shape) for e, y in zip(elements, outputs, strict=True)]


@dataclass
class _Canonical:
    """Builds signed expressions, each once.

    `order` numbers expressions by their hash, in the order in which they come. It also keeps them:
    CasADi may give the hash of a deleted expression to a new one.
    """

    known: dict[tuple[int, ...], ca.SX] = field(default_factory=dict)
    order: dict[int, tuple[int, ca.SX]] = field(default_factory=dict)

    def number(self, value: float) -> Signed:
        """A number as a sign and its absolute value."""
        return value < 0, ca.SX(abs(value))

    def apply(self, kind: int, *operands: Signed) -> Signed:
        """The result of CasADi's operation `kind`, with the sign moved outwards where it can be."""
        if kind in SUMS:
            return self._sum(operands[0], operands[1], kind == ca.OP_SUB)
        signs = [negative for negative, _ in operands]
        values = [value for _, value in operands]
        if kind == ca.OP_NEG:
            return not signs[0], values[0]
        if kind in EVEN:
            return self._made(False, kind, *values)
        if kind in ODD:
            return self._made(signs[0], kind, *values)
        if kind == ca.OP_MUL:
            return self._made(signs[0] != signs[1], kind, *sorted(values, key=self._age))
        if kind == ca.OP_DIV:
            return self._made(signs[0] != signs[1], kind, *values)
        return self._made(False, kind, *(_plain(x) for x in operands))

    def _sum(self, one: Signed, other: Signed, minus: bool) -> Signed:
        """+-a +- b as +-(a +- b), the older operand first."""
        both = one, (other[0] != minus, other[1])
        (negative, a), (sign, b) = sorted(both, key=lambda x: self._age(x[1]))
        return self._made(negative, ca.OP_SUB if sign != negative else ca.OP_ADD, a, b)

    def _age(self, x: ca.SX) -> int:
        return self.order.setdefault(x.element_hash(), (len(self.order), x))[0]

    def _made(self, negative: bool, kind: int, *values: ca.SX) -> Signed:
        key = (kind, *map(self._age, values))
        if key not in self.known:
            self.known[key] = _applied(kind, *values)
        value = self.known[key]
        if value.is_op(ca.OP_NEG):
            return not negative, value.dep(0)
        return negative, value


def _plain(x: Signed) -> ca.SX:
    return -x[1] if x[0] else x[1]


def _applied(kind: int, *operands: Any) -> Any:
    """The result of CasADi's operation `kind` on operands that are all SX, or all MX."""
    of = type(operands[0])
    return of.unary(kind, *operands) if len(operands) == 1 else of.binary(kind, *operands)


FEW = 8  # points at which evaluating one by one is as fast as all at once


# blocks whose functions are kept for the next program of the process: twice those of all programs
# of a jump
KEPT = 400


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
    return _kept.get(text, lambda: _rewritten(z, p, f, g), KEPT)


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

    found = replay(f, given, number, _applied)
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
        outputs = replay(f, [[row.T for row in group] for group in rows], ca.MX, _applied)
        each = [[e if e.numel() == points else ca.repmat(e, points) for e in y] for y in outputs]
        stacked = [ca.horzcat(*rows).T if rows else ca.MX(0, points) for rows in each]
        return ca.Function(f.name(), inputs, stacked, {"never_inline": True})


@contextmanager
def _as_written() -> Iterator[None]:
    """Without CasADi's simplifications, which may change the rounding."""
    before = ca.GlobalOptions.getSimplificationOnTheFly()
    ca.GlobalOptions.setSimplificationOnTheFly(False)
    try:
        yield
    finally:
        ca.GlobalOptions.setSimplificationOnTheFly(before)
