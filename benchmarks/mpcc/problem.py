"""A program with complementarity pairs, read from a file, ready for kemba's wrapper of IPOPT."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import yaml

from kemba.effects.formula import evaluate, names_of, parse_formula
from kemba.ocp.functions.blocks import RowBlock, block_problem

FOLDER = Path(__file__).parent
INF = np.inf


@dataclass(frozen=True)
class Parts:
    """f, equalities, inequalities and both sides of the pairs as expressions of x."""

    x: ca.SX
    f: ca.SX
    zero: ca.SX
    positive: ca.SX
    a: ca.SX
    b: ca.SX


class Mpcc:
    """min f, zero = 0, positive >= 0, 0 <= a, b and a b <= p; a program as `Ipopt` asks for it.

    `lower`, `upper`, `start` (n,) are of the variables, in the order of their names; the one
    parameter p is the relaxation of the pairs. `branch` chooses a side of each pair that is zero;
    without it the pairs are relaxed.
    """

    def __init__(self, name: str, data: dict[str, Any], branch: tuple[bool, ...] = ()) -> None:
        self.data = data
        self.name, self.best, self.pairs = name, float(data["best"]), len(data["pairs"])
        self.parts, bounds, start = _read(data)
        self.lower, self.upper = np.array(bounds).T
        self.start = np.clip(start, self.lower, self.upper)
        p, parts = ca.SX.sym("p"), self.parts
        sides = [a if first else b for a, b, first in zip(
            ca.vertsplit(parts.a), ca.vertsplit(parts.b), branch, strict=True
        )] if branch else []  # fmt: skip
        products = ca.vertcat(*sides) if branch else parts.a * parts.b - p
        g = ca.vertcat(parts.zero, parts.positive, parts.a, parts.b, products)
        equal, more = parts.zero.numel(), parts.positive.numel() + 2 * self.pairs
        low, last = (0.0 if branch else -INF), np.zeros(self.pairs)
        self.g_lower = np.concatenate([np.zeros(equal + more), last + low])
        self.g_upper = np.concatenate([np.zeros(equal), np.full(more, INF), last])
        columns = np.arange(parts.x.numel())[None, :]
        self.problem = block_problem([RowBlock(parts.x, g, parts.f, columns)], columns.size, p)

    def nearest(self, x: np.ndarray) -> tuple[bool, ...]:
        """Which side of each pair is smaller at x (n,): True for the first."""
        sides = ca.Function("sides", [self.parts.x], [self.parts.a - self.parts.b])
        return tuple(bool(d <= 0.0) for d in np.array(sides(x)).ravel())

    def branch(self, sides: tuple[bool, ...]) -> Mpcc:
        """The smooth program in which these sides are zero."""
        return Mpcc(self.name, self.data, sides)

    def violation(self, x: np.ndarray) -> float:
        """The largest violation of rows and bounds, or product of a pair, at x (n,)."""
        f = ca.Function("f", [self.parts.x], [self.parts.zero, self.parts.positive, self.parts.a,
                                              self.parts.b])  # fmt: skip
        zero, positive, a, b = (np.array(part).ravel() for part in f(x))
        boxes = np.maximum(self.lower - x, x - self.upper)
        over = [np.abs(zero), -positive, -a, -b, np.abs(a * b), boxes]
        return float(max(np.max(part, initial=0.0) for part in over))

    def cost(self, x: np.ndarray) -> float:
        """The cost at x (n,)."""
        return float(ca.Function("f", [self.parts.x], [self.parts.f])(x))


def _read(data: dict[str, Any]) -> tuple[Parts, list[tuple[float, float]], np.ndarray]:
    trees = {
        "f": [parse_formula(str(data["minimise"]))],
        "zero": [parse_formula(str(row)) for row in data.get("zero", [])],
        "positive": [parse_formula(str(row)) for row in data.get("positive", [])],
        "a": [parse_formula(str(a)) for a, _ in data["pairs"]],
        "b": [parse_formula(str(b)) for _, b in data["pairs"]],
    }
    names = sorted(set().union(*(names_of(tree) for rows in trees.values() for tree in rows)))
    x = ca.SX.sym("x", len(names))
    at = dict(zip(names, ca.vertsplit(x), strict=True))
    values = {
        key: ca.vertcat(*(ca.SX(evaluate(tree, at)) for tree in rows)) if rows else ca.SX(0, 1)
        for key, rows in trees.items()
    }
    free, box = data.get("free", ()), data.get("bounds", {})
    bounds = [tuple(map(float, box.get(n, (-INF if n in free else 0.0, INF)))) for n in names]
    start = np.array([float(data.get("start", {}).get(n, 0.0)) for n in names])
    return Parts(x, **values), bounds, start


def problems() -> dict[str, dict[str, Any]]:
    """Every problem of the files beside this one: name -> what is written there."""
    found: dict[str, dict[str, Any]] = {}
    for path in sorted(FOLDER.glob("*.yaml")):
        found |= yaml.safe_load(path.read_text(encoding="utf-8"))
    return found


def branches(name: str, data: dict[str, Any]) -> Iterator[Mpcc]:
    """The smooth programs of a problem: in each, one side of every pair is zero."""
    for sides in itertools.product((True, False), repeat=len(data["pairs"])):
        yield Mpcc(name, data, sides)
