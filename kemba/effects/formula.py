"""Formulas that users write: parsed by a whitelist, checked for their dimension, evaluated.

Nothing is ever handed to Python's `eval`. The syntax tree is walked, and every node that is not
arithmetic on known names is refused. Constants such as `2*9.81` are computed once, as floats.
"""

import ast
import itertools
import math
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca

from kemba.errors import suggest
from kemba.units import called_dimension, parse_unit, si_name


def check_dimension(tree: ast.expr, units: Mapping[str, str], unit: str) -> None:
    """Check that a formula's value has the dimension of `unit`; `units` are those of its names.
    Raises ValueError with the part of the formula that is wrong."""
    found = _Dimensions(units).of(tree)
    if not found.fits(parse_unit(unit)):
        raise ValueError(
            f"'{ast.unparse(tree)}' is {called_dimension(found.unit)}; "
            f"{called_dimension(parse_unit(unit))} ({unit}) was expected"
        )


def unit_of(tree: ast.expr, units: Mapping[str, str]) -> str:
    """The SI unit of a formula's value, `units` are those of its names. Raises ValueError with the
    part of the formula whose dimensions do not fit together."""
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
            return self.of(node.operand)
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
        return _Dimension(left.unit / right.unit)

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


LONGEST = 500  # characters
DEEPEST = 40  # nested operations; Python's own stack ends at about 1000
OPERATORS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
PURE: dict[str, Callable[..., Any]] = {  # of one number without dimension
    name: getattr(ca, name) for name in ("exp", "log", "tanh", "sin", "cos", "tan", "atan")
}
SAME: dict[str, Callable[..., Any]] = {"abs": ca.fabs, "min": ca.fmin, "max": ca.fmax}
FUNCTIONS: dict[str, Callable[..., Any]] = {**PURE, **SAME, "sqrt": ca.sqrt}


def parse_formula(text: str) -> ast.expr:
    """The syntax tree of a formula, with its constant parts computed. Raises ValueError where the
    text is no formula, is too long, or uses what is not allowed."""
    if len(text) > LONGEST:
        raise ValueError(f"is longer than {LONGEST} characters")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, RecursionError, MemoryError, ValueError) as error:
        column = getattr(error, "offset", None)
        place = f" near column {column}" if column else ""
        raise ValueError(f"'{text}' is not a formula{place}; such as '-c*v*abs(v)'") from None
    _check_depth(tree)
    for node in ast.walk(tree):
        _check(node)
    folded: ast.expr = _Folding().visit(tree)
    return folded


def names_of(tree: ast.expr) -> set[str]:
    """Every name a formula reads, functions excepted."""
    functions = {node.func for node in ast.walk(tree) if isinstance(node, ast.Call)}
    return {n.id for n in ast.walk(tree) if isinstance(n, ast.Name) and n not in functions}


def evaluate(node: ast.expr, values: Mapping[str, Any]) -> Any:
    """Value of a checked tree; `values` may be numbers or symbols."""
    if isinstance(node, ast.Constant):
        return node.value
    if isinstance(node, ast.Name):
        return values[node.id]
    if isinstance(node, ast.UnaryOp):
        operand = evaluate(node.operand, values)
        return -operand if isinstance(node.op, ast.USub) else operand
    if isinstance(node, ast.BinOp):
        left, right = evaluate(node.left, values), evaluate(node.right, values)
        return OPERATORS[type(node.op)](left, right)
    assert isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    return FUNCTIONS[node.func.id](*(evaluate(arg, values) for arg in node.args))


def check_finite(tree: ast.expr, ranges: Mapping[str, Sequence[float]]) -> None:
    """Check that a formula is finite for every combination of `ranges`.

    `ranges`: the values to try of every name that the formula reads. Raises ValueError with the
    first combination at which the value is not finite.
    """
    names = sorted(names_of(tree))
    symbols = [ca.SX.sym(name) for name in names]
    value = ca.SX(evaluate(tree, dict(zip(names, symbols, strict=True))))
    points = list(itertools.product(*(ranges[name] for name in names)))
    table = ca.DM(points).T if names else ca.DM(0, 1)
    found = ca.Function("f", [ca.vertcat(*symbols)], [value]).map(len(points))(table)
    for point, number in zip(points, found.full().ravel(), strict=True):
        if not math.isfinite(number):
            at = ", ".join(f"{name} = {x:g}" for name, x in zip(names, point, strict=True))
            raise ValueError(f"'{ast.unparse(tree)}' has no finite value at {at}")


def _check_depth(tree: ast.expr) -> None:
    """Without recursion, which a deep tree would break."""
    layer: list[ast.AST] = [tree]
    for _ in range(DEEPEST):
        layer = [inner for node in layer for inner in ast.iter_child_nodes(node)]
        if not layer:
            return
    raise ValueError(f"is nested deeper than {DEEPEST} operations")


class _Folding(ast.NodeTransformer):
    """Puts every part that reads no name as one number, which must be finite."""

    def visit(self, node: ast.AST) -> Any:
        written = ast.unparse(node)[:60]
        self.generic_visit(node)
        if not isinstance(node, ast.expr) or names_of(node):
            return node
        try:
            value = 1.0 * evaluate(node, {})
        except ArithmeticError:
            value = math.nan
        if isinstance(value, complex) or not math.isfinite(value):
            raise ValueError(f"'{written}' has no finite value")
        return ast.Constant(float(value))


def _check(node: ast.AST) -> None:
    if isinstance(node, ast.BitXor):
        raise ValueError("'^' is no power here; write '**', such as 'v**2'")
    if isinstance(node, ast.Call):
        name = getattr(node.func, "id", ast.unparse(node.func))
        if name == "sign":
            raise ValueError("'sign' jumps; write a smooth tanh(v/v_s) with a parameter v_s")
        if name not in FUNCTIONS:
            raise ValueError(f"unknown function '{name}'; {suggest(name, FUNCTIONS)}")
        count = 2 if name in ("min", "max") else 1
        if len(node.args) != count or node.keywords:
            raise ValueError(f"'{name}' takes {count} argument{'s' * (count > 1)}")
    elif isinstance(node, ast.Constant):
        if isinstance(node.value, bool) or not isinstance(node.value, (int, float)):
            raise ValueError(f"'{ast.unparse(node)}' is not a number")
    elif not isinstance(
        node, (ast.Name, ast.BinOp, ast.UnaryOp, *OPERATORS, ast.USub, ast.UAdd, ast.Load)
    ):
        written = ast.unparse(node) if isinstance(node, ast.expr) else type(node).__name__
        raise ValueError(f"'{written}' cannot stand in a formula; only + - * / ** and functions")
