"""What a task may ask about: a quantity by its name, or arithmetic on quantities with units.

`front/foot/x - rear/foot/x` is an expression at one moment;
`at(end, body/vx) - at(start, body/vx)` compares two moments.
"""

import ast
import re
from collections.abc import Callable, Mapping

import casadi as ca
import numpy as np

from kemba.effects.formula import evaluate, names_of, parse_formula, unit_of
from kemba.errors import KembaError, suggest
from kemba.quantity import Quantity
from kemba.trajectory import Array, Trajectory

NAME = re.compile(r"[A-Za-z_]\w*(?:/[A-Za-z_]\w*)+")  # a quantity, or what is meant as one
MOMENT = r"\s*at\(\s*([^,()]+?)\s*,\s*((?:[^()]|\([^()]*\))+?)\s*\)\s*"
TWO_MOMENTS = re.compile(rf"{MOMENT}-{MOMENT}")


def two_moments(text: str) -> tuple[str, str, str, str] | None:
    """The two parts of `at(end, body/vx) - at(start, body/vx)`: the words for the later moment, the
    expression there, and the same for the earlier one; None where the text has no `at(...)`. Raises
    ValueError where `at(...)` stands in any other form."""
    if not re.search(r"\bat\(", text):
        return None
    match = TWO_MOMENTS.fullmatch(text)
    if match is None:
        raise ValueError(f"'{text}' is not of the form 'at(end, body/x) - at(start, body/x)'")
    late, later, early, earlier = match.groups()
    return late, later, early, earlier


def expressed(text: str, known: Mapping[str, Quantity]) -> Quantity:
    """The quantity of an expression: its text as name, its unit, its size. Raises KembaError for an
    unknown name, ValueError for what is no expression or mixes units."""
    tree, names = _parsed(text)
    for name in names.values():
        if name not in known:
            raise KembaError("", f"unknown quantity '{name}'", hint=suggest(name, known))
    if not names:
        raise ValueError(f"'{text}' names no quantity")
    units = {symbol: known[name].unit for symbol, name in names.items()}
    unit = unit_of(tree, units)
    size = max((known[n].scale for n in names.values() if known[n].unit == unit), default=1.0)
    return Quantity(text, unit, scale=size)


def is_expression(text: str) -> bool:
    """Whether a text is more than the name, or the pattern, of quantities."""
    return re.fullmatch(r"[\w*?/\[\]!]+", text) is None


def symbolic(text: str, of: Callable[[str], ca.SX]) -> ca.SX:
    """An expression of symbols; `of` gives that of every quantity."""
    tree, names = _parsed(text)
    return ca.SX(evaluate(tree, {symbol: of(name) for symbol, name in names.items()}))


def along(text: str, motion: Trajectory) -> Array | None:
    """The values (n,) of a quantity or an expression along a motion, by its columns alone; None
    where it lacks one."""
    if text in motion:
        return motion[text]
    if not is_expression(text):
        return None
    tree, parsed = _parsed(text)
    names = {s: n if n in motion else re.sub(r"/gap$", "/z", n) for s, n in parsed.items()}
    if any(name not in motion for name in names.values()):
        return None
    symbols = {symbol: ca.SX.sym(symbol) for symbol in names}
    f = ca.Function("f", list(symbols.values()), [ca.SX(evaluate(tree, symbols))])
    rows = (motion[name][None, :] for name in names.values())
    return np.asarray(f.map(len(motion))(*rows)).ravel()


def _parsed(text: str) -> tuple[ast.expr, dict[str, str]]:
    """The tree of an expression, and the quantity that each of its symbols stands for."""
    symbols: dict[str, str] = {}

    def symbol(match: re.Match[str]) -> str:
        return symbols.setdefault(match[0], f"q{len(symbols)}")

    tree = parse_formula(NAME.sub(symbol, text).replace("^", "**"))
    names = {s: name for name, s in symbols.items()}
    return tree, names | {name: name for name in names_of(tree) - set(names)}
