"""The dimension of every part of a formula: a force is no length, and `tanh` takes a number."""

import ast
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from kemba.effects.formula import SAME
from kemba.units import called_dimension, parse_unit, si_name


def check_dimension(tree: ast.expr, units: Mapping[str, str], unit: str) -> None:
    """Check that a formula's value has the dimension of `unit`; `units` are those of its names.

    Raises ValueError with the part of the formula that is wrong.
    """
    found = _Dimensions(units).of(tree)
    if not found.fits(parse_unit(unit)):
        raise ValueError(
            f"'{ast.unparse(tree)}' is {called_dimension(found.unit)}; "
            f"{called_dimension(parse_unit(unit))} ({unit}) was expected"
        )


def unit_of(tree: ast.expr, units: Mapping[str, str]) -> str:
    """The SI unit of a formula's value, `units` are those of its names.

    Raises ValueError with the part of the formula whose dimensions do not fit together.
    """
    return si_name(_Dimensions(units).of(tree).unit)


@dataclass(frozen=True)
class _Dimension:
    unit: Any  # pint.Unit
    number: float | None = None  # of a literal

    def fits(self, unit: Any) -> bool:
        """Whether it can stand where `unit` is expected; a literal 0 has every dimension."""
        return self.number == 0 or bool(self.unit.dimensionality == unit.dimensionality)

    @property
    def pure(self) -> bool:
        """Whether it is a number without dimension."""
        return self.number == 0 or not self.unit.dimensionality


class _Dimensions:
    """Dimension of every part of a formula."""

    def __init__(self, units: Mapping[str, str]) -> None:
        self.units = units

    def of(self, node: ast.expr) -> _Dimension:
        """The dimension of a part of a formula. Raises ValueError where its parts do not fit
        together."""
        if isinstance(node, ast.Constant):
            return _Dimension(parse_unit("1"), float(node.value))  # type: ignore[arg-type]
        if isinstance(node, ast.Name):
            return _Dimension(parse_unit(self.units[node.id]))
        if isinstance(node, ast.UnaryOp):
            inner = self.of(node.operand)
            return _Dimension(inner.unit, None if inner.number is None else -inner.number)
        if isinstance(node, ast.BinOp):
            return self._binary(node)
        assert isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
        return self._call(node, node.func.id)

    def _binary(self, node: ast.BinOp) -> _Dimension:
        left, right = self.of(node.left), self.of(node.right)
        if isinstance(node.op, ast.Pow):
            return self._power(node, left, right)
        if isinstance(node.op, (ast.Add, ast.Sub)):
            return self._alike(node, left, right)
        if isinstance(node.op, ast.Mult):
            return _Dimension(left.unit * right.unit)
        number = None
        if left.number is not None and right.number:
            number = left.number / right.number  # so that v**(3/2) has a dimension
        return _Dimension(left.unit / right.unit, number)

    def _power(self, node: ast.BinOp, base: _Dimension, exponent: _Dimension) -> _Dimension:
        if not exponent.pure:
            raise ValueError(f"the exponent of '{ast.unparse(node)}' has a dimension")
        if base.pure:
            return _Dimension(parse_unit("1"))
        if exponent.number is None:
            raise ValueError(
                f"'{ast.unparse(node)}' raises {called_dimension(base.unit)} to a power that is "
                "not a plain number; divide the base by a parameter of its unit"
            )
        return _Dimension(base.unit**exponent.number)

    def _alike(self, node: ast.expr, left: _Dimension, right: _Dimension) -> _Dimension:
        if right.fits(left.unit):
            return left
        if left.fits(right.unit):
            return right
        raise ValueError(
            f"'{ast.unparse(node)}' mixes {called_dimension(left.unit)} with "
            f"{called_dimension(right.unit)}"
        )

    def _call(self, node: ast.Call, name: str) -> _Dimension:
        args = [self.of(arg) for arg in node.args]
        if name == "sqrt":
            return _Dimension(args[0].unit ** 0.5)
        if name in SAME:
            return self._alike(node, args[0], args[-1]) if len(args) > 1 else args[0]
        if not args[0].pure:
            raise ValueError(
                f"the argument of '{ast.unparse(node)}' is {called_dimension(args[0].unit)}; "
                "divide it by a parameter of that unit"
            )
        return _Dimension(parse_unit("1"))
