"""A program with complementarity pairs, from CasADi symbols to what IPOPT evaluates."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from kemba.errors import KembaError, suggest
from kemba.ocp.functions.problem import derivative

INF = np.inf
BOUNDS = ("lbx", "ubx", "lbg", "ubg")
Symbols = Any  # SX or MX: CasADi has no types


@dataclass(frozen=True)
class SparseFunctions:
    """f and g of x with parameters p, and their exact sparse derivatives, as `Ipopt` asks."""

    x: Symbols
    parameter: Symbols
    f: Symbols
    g: Symbols

    @property
    def size(self) -> int:
        """How many variables there are."""
        return int(self.x.numel())

    @property
    def rows(self) -> int:
        """How many rows there are."""
        return int(self.g.numel())

    @property
    def nlp(self) -> dict[str, Symbols]:
        """x, p, f and g as expressions."""
        return {"x": self.x, "p": self.parameter, "f": self.f, "g": self.g}

    @cached_property
    def grad_f(self) -> ca.Function:
        """(x, p) -> f and its gradient."""
        at, results = [self.x, self.parameter], [self.f, ca.gradient(self.f, self.x)]
        return derivative("grad_f", at, results)

    @cached_property
    def jac_g(self) -> ca.Function:
        """(x, p) -> g and its Jacobian."""
        at, results = [self.x, self.parameter], [self.g, ca.jacobian(self.g, self.x)]
        return derivative("jac_g", at, results)

    @cached_property
    def hess_lag(self) -> ca.Function:
        """(x, p, lam_f, lam_g) -> upper triangle of the Lagrangian's Hessian."""
        kind = type(self.x)
        lam_f, lam_g = kind.sym("lam_f"), kind.sym("lam_g", self.rows)
        lagrangian = lam_f * self.f + ca.dot(lam_g, self.g)
        hessian = ca.triu(ca.hessian(lagrangian, self.x)[0])
        return derivative("hess_lag", [self.x, self.parameter, lam_f, lam_g], [hessian])


@dataclass(frozen=True)
class MpccRows:
    """A program as `Ipopt` asks for it: rows g, one for each distinct side that is no variable, and
    the products of the pairs; bounds of all of them."""

    problem: SparseFunctions
    lower: np.ndarray
    upper: np.ndarray
    g_lower: np.ndarray
    g_upper: np.ndarray


class Mpcc:
    """min f(x), lbg <= g(x) <= ubg, lbx <= x <= ubx, 0 <= G(x), H(x) and G H = 0, checked.

    `a`, `b` (pairs,): where the two sides of each pair are found in `places(x)`, the variables (n,)
    followed by the distinct sides that are no variables.
    Raises KembaError where the parts do not fit each other, or are not numbers.
    """

    def __init__(
        self, x: Symbols, f: Symbols, g: Symbols, G: Symbols, H: Symbols,
        bounds: Mapping[str, Any], start: Any, p: tuple[Symbols, Any] | None,
    ) -> None:  # fmt: skip
        kind = type(x)
        if kind not in (ca.SX, ca.MX) or not x.is_valid_input():
            raise _wrong("x", "is not made of symbols", "ca.SX.sym or ca.MX.sym")
        symbols, values = p if p is not None else (kind(0, 1), np.zeros(0))
        self.p = _numbers("p", values, symbols.numel())
        parts = [_column(kind, name, part) for name, part in
                 (("f", f), ("g", g), ("G", G), ("H", H))]  # fmt: skip
        if parts[0].numel() != 1:
            raise _wrong("f", f"has {parts[0].numel()} entries", "one number, the cost")
        if parts[2].numel() != parts[3].numel():
            raise _wrong(
                "G and H", f"G has {parts[2].numel()} entries and H {parts[3].numel()}",
                "one side of every pair in each",
            )  # fmt: skip
        self.functions = _function(x, symbols, parts)
        made: Any = ca.MX if self.functions.is_a("MXFunction") else ca.SX
        at = [made.sym("x", x.numel()), made.sym("p", symbols.numel())]
        f, g, G, H = self.functions(*at)
        self.size, self.g_rows, self.pairs = at[0].numel(), g.numel(), G.numel()
        self._bound(bounds)
        self.start = np.clip(_numbers("start", start, self.size), self.lbx, self.ubx)
        self.a, self.b, sides = _places(at[0], G, H)
        self.sides = ca.Function("sides", at, [sides])
        rows = ca.vertcat(g, sides, G * H)
        self.problem = SparseFunctions(at[0], at[1], f, rows)
        self._evaluate()

    def _bound(self, bounds: Mapping[str, Any]) -> None:
        for name in bounds:
            if name not in BOUNDS:
                raise _wrong("bounds", f"unknown bound '{name}'", suggest(name, BOUNDS))
        n, m = self.size, self.g_rows
        each = ((n, -INF), (n, INF), (m, -INF), (m, INF))
        values = [_numbers(name, bounds.get(name, default), length, finite=False)
                  for name, (length, default) in zip(BOUNDS, each, strict=True)]  # fmt: skip
        self.lbx, self.ubx, self.lbg, self.ubg = values
        for what, low, high in (("x", self.lbx, self.ubx), ("g", self.lbg, self.ubg)):
            empty = np.flatnonzero((low > high) | (low == INF) | (high == -INF))
            if len(empty):
                i = int(empty[0])
                raise _wrong(f"bounds of {what}", f"entry {i}: no number lies between {low[i]:g} "
                             f"and {high[i]:g}", "a lower bound below the upper one")  # fmt: skip

    def _evaluate(self) -> None:
        """Raise KembaError where something is not a number at the start."""
        for name, value in zip(("f", "g", "G", "H"), self.at(self.start), strict=True):
            bad = np.flatnonzero(~np.isfinite(value))
            if len(bad):
                where = f"entry {bad[0]} is {value[bad[0]]:g} at the start"
                raise _wrong(name, where, "a start at which all functions are finite")

    def at(self, x: np.ndarray) -> list[np.ndarray]:
        """f (1,), g (rows,), G and H (pairs,) at x (n,)."""
        return [np.array(part).ravel() for part in self.functions(x, self.p)]

    def places(self, x: np.ndarray) -> np.ndarray:
        """The variables x (n,), and all sides that are none of them."""
        return np.concatenate([x, np.array(self.sides(x, self.p)).ravel()])

    def feasibility(self, x: np.ndarray) -> float:
        """The largest violation of bounds, rows and signs of sides at x (n,)."""
        _, g, G, H = self.at(x)
        over = [self.lbx - x, x - self.ubx, self.lbg - g, g - self.ubg, -G, -H]
        return float(max(np.max(part, initial=0.0) for part in over))

    def complementarity(self, x: np.ndarray) -> float:
        """The largest product of a pair at x (n,)."""
        _, _, G, H = self.at(x)
        return float(np.max(np.abs(G * H), initial=0.0))

    def relaxed(self, sigma: float) -> MpccRows:
        """The program whose products are at most `sigma`; any product where that is infinite."""
        low, high = self._limits()
        return self._rows(low, high, sigma)

    def branch(self, first: np.ndarray) -> MpccRows:
        """The program in which of every pair one side is zero: the first where `first` (pairs,)."""
        low, high = self._limits()
        zero = np.where(first, self.a, self.b)
        high[zero] = np.minimum(high[zero], 0.0)
        return self._rows(low, high, INF)

    def _limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Bounds of the places: of every side at least zero."""
        more = self.problem.rows - self.g_rows - self.pairs
        low = np.concatenate([self.lbx, np.zeros(more)])
        high = np.concatenate([self.ubx, np.full(more, INF)])
        used = np.concatenate([self.a, self.b])
        low[used] = np.maximum(low[used], 0.0)
        return low, high

    def _rows(self, low: np.ndarray, high: np.ndarray, sigma: float) -> MpccRows:
        n, pairs = self.size, np.ones(self.pairs)
        return MpccRows(
            self.problem, low[:n], high[:n],
            np.concatenate([self.lbg, low[n:], -INF * pairs]),
            np.concatenate([self.ubg, high[n:], sigma * pairs]),
        )  # fmt: skip


def _wrong(where: str, what: str, expected: str = "") -> KembaError:
    return KembaError(f"solve_mpcc: {where}", what, expected)


def _column(kind: type, name: str, part: Any) -> Symbols:
    try:
        return ca.densify(ca.vec(kind(part)))
    except (NotImplementedError, TypeError):
        what = "is not an expression of the same kind as x"
        raise _wrong(name, what, f"{kind.__name__}, or numbers") from None


def _numbers(name: str, values: Any, length: int, finite: bool = True) -> np.ndarray:
    try:
        given = np.asarray(values, float).ravel()
    except (TypeError, ValueError):
        raise _wrong(name, "is not made of numbers") from None
    if given.size not in (1, length):
        raise _wrong(name, f"has {given.size} entries", f"{length}, or one for all of them")
    bad = np.flatnonzero(~np.isfinite(given) if finite else np.isnan(given))
    if len(bad):
        raise _wrong(name, f"entry {bad[0]} is {given[bad[0]]:g}", "a number")
    return np.full(length, given[0]) if given.size == 1 and length else given[:length].copy()


def _function(x: Symbols, p: Symbols, parts: Sequence[Symbols]) -> ca.Function:
    """(x, p) -> the parts; of scalar instructions where CasADi can write it so."""
    try:
        f = ca.Function("parts", [ca.vec(x), ca.vec(p)], list(parts))
    except RuntimeError as error:
        free = str(error).splitlines()[-1]
        raise _wrong("expressions", "hold symbols that are neither in x nor in p", free) from None
    try:
        return f.expand()
    except RuntimeError:  # a part of it, such as an interpolant, has no scalar instructions
        return f


def _places(x: Symbols, G: Symbols, H: Symbols) -> tuple[np.ndarray, np.ndarray, Symbols]:
    """Where sides are found, and those that are no variables. Sides that occur twice are one."""
    both: Symbols = ca.vertcat(G, H)
    known: dict[Any, int] = {}
    more: list[Symbols] = []
    if isinstance(x, ca.SX):
        both = ca.cse(both)
        known = {x[j].element_hash(): j for j in range(x.numel())}
    at = []
    for i in range(both.numel()):
        key = both[i].element_hash() if isinstance(x, ca.SX) else ("row", i)
        if key not in known:
            known[key] = x.numel() + len(more)
            more.append(both[i])
        at.append(known[key])
    index = np.array(at, int)
    sides: Symbols = ca.vertcat(*more) if more else type(x)(0, 1)
    return index[: G.numel()], index[G.numel() :], sides
