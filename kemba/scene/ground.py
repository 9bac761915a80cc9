"""The ground: height, slope, normal and friction at any place, for arrays and symbols alike.

Lines of terrain begin one behind the other. Between two of them the ground goes from the one to the
other over the width `EDGE` by a polynomial with two continuous derivatives, so that a wall is a
steep, rounded contact like any other, and the same in plans, executions and identification. The
rounding lies on the lower side: the ground is nowhere lower than the one that is written, but for
0.2 mm at the foot of a ramp.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from kemba.scene.terrain.base import Terrain

EDGE = 0.02  # m; about the way of a foot in two steps of a plan, so that nodes see an edge
LEVEL = 1e-9  # m; a smaller jump between two lines is none


def rise(x: ca.SX, begin: float, width: float = EDGE) -> ca.SX:
    """0 before `begin` [m], 1 from `begin` + `width` on, twice continuously differentiable."""
    u = ca.fmax(0, ca.fmin(1, (x - begin) / width))
    return u**3 * (10 - u * (15 - 6 * u))


class Ground:
    """The ground of lines of terrain; flat at 0 without any.

    Places x [m] are numbers, arrays (n,) or SX; what is found has their form, but for ground that
    is `level`, where height, slope and normal are plain numbers.
    """

    def __init__(self, terrain: Sequence[Terrain] = ()) -> None:
        self.pieces = sorted(terrain, key=lambda t: -np.inf if t.begin is None else t.begin)

    @cached_property
    def level(self) -> float | None:
        """The height [m] of ground that is level everywhere; None where it is not."""
        h = ca.simplify(self._expressions[1])
        return float(h) if h.is_constant() else None

    @cached_property
    def _expressions(self) -> tuple[ca.SX, ca.SX]:
        x, h, last = ca.SX.sym("x"), ca.SX(0), ca.SX(0)
        for piece in self.pieces:
            at = piece.begin or 0.0
            before = _at(last, x, at)
            new = piece.surface(x, before)
            if new is None:
                continue
            jump = _at(new, x, at) - before
            if piece.begin is None:
                h = new
            elif not ca.is_equal(ca.SX(new), ca.SX(last), 3):
                back = 0.5 if abs(jump) < LEVEL else float(jump > 0)
                h = h + rise(x, at - back * EDGE) * (new - last)
            last = ca.SX(new)
        return x, h

    @cached_property
    def _functions(self) -> tuple[ca.Function, ca.Function]:
        x, h = self._expressions
        slope = ca.densify(ca.jacobian(h, x))
        return ca.Function("height", [x], [h]), ca.Function("slope", [x], [slope])

    def height(self, x: Any) -> Any:
        """Height [m] at x."""
        return self.level if self.level is not None else called(self._functions[0], x)

    def slope(self, x: Any) -> Any:
        """Its derivative along x [1]."""
        return 0.0 if self.level is not None else called(self._functions[1], x)

    def normal(self, x: Any) -> tuple[Any, Any]:
        """Components (x, z) of the unit vector out of the ground; along the ground, forward, is
        (z, -x)."""
        if self.level is not None:
            return 0.0, 1.0
        slope = self.slope(x)
        size = (1 + slope**2) ** 0.5
        return -slope / size, 1 / size

    def friction(self, x: Any, usual: Any) -> Any:
        """Friction coefficient at x, `usual` where no line says one."""
        mu = last = usual
        for piece in (p for p in self.pieces if p.friction is not None):
            if piece.begin is None:
                mu = piece.friction
            else:
                share = share_of(x, piece.begin - EDGE)
                mu = mu + share * (piece.friction - last)
            last = piece.friction
        return mu

    @property
    def extent(self) -> tuple[float, float]:
        """Lowest and highest height [m] within 5 m of x = 0."""
        if self.level is not None:
            return self.level, self.level
        heights = self.height(np.linspace(-5.0, 5.0, 2001))
        return float(heights.min()), float(heights.max())

    def highest(self, a: float, b: float) -> float:
        """The greatest height [m] between two places."""
        return float(np.max(self.height(np.linspace(a, b, 201))))

    def line(self, a: float, b: float) -> tuple[np.ndarray, np.ndarray]:
        """Places and heights (n,) [m] from `a` to `b` that draw it."""
        x = np.linspace(a, b, 2 if self.level is not None else max(2, int((b - a) / EDGE * 4)))
        return x, np.broadcast_to(self.height(x), x.shape)


def _at(expression: Any, x: ca.SX, place: float) -> float:
    return float(ca.Function("at", [x], [ca.SX(expression)])(place))


def share_of(x: Any, begin: float) -> Any:
    """`rise` at places of any form."""
    place = ca.SX.sym("x")
    return called(ca.Function("share", [place], [rise(place, begin)]), x)


def called(function: ca.Function, x: Any) -> Any:
    """A scalar function at a number, at every entry of an array (n,), or of an expression."""
    if isinstance(x, ca.SX):
        return function(x)
    values = np.asarray(x, dtype=float)
    found = np.asarray(function(values.reshape(1, -1))).reshape(values.shape)
    return found if values.ndim else float(found)
