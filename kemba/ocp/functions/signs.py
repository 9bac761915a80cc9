"""Expressions in which what differs by a sign alone is written once.

The sines and lever arms of a mirrored leg are the negatives of the other leg's. CasADi does not see
this and computes both. Here signs are moved out of even and odd functions, products and sums, so
that both legs share the same expressions. Rounding does not change: IEEE arithmetic is symmetric.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import casadi as ca

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
        (negative, a), (sign, b) = sorted((one, (other[0] != minus, other[1])), key=self._second)
        return self._made(negative, ca.OP_SUB if sign != negative else ca.OP_ADD, a, b)

    def _second(self, x: Signed) -> int:
        return self._age(x[1])

    def _age(self, x: ca.SX) -> int:
        return self.order.setdefault(x.element_hash(), (len(self.order), x))[0]

    def _made(self, negative: bool, kind: int, *values: ca.SX) -> Signed:
        key = (kind, *map(self._age, values))
        if key not in self.known:
            make = ca.SX.unary if len(values) == 1 else ca.SX.binary
            self.known[key] = make(kind, *values)
        value = self.known[key]
        if value.is_op(ca.OP_NEG):
            return not negative, value.dep(0)
        return negative, value


def _plain(x: Signed) -> ca.SX:
    return -x[1] if x[0] else x[1]
