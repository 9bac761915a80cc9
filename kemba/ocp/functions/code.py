"""The functions of a block, with exact derivatives; equal blocks of one process share them.

A plan is found with several programs: coarse and fine grids, half and whole robot, two schemes.
Most of their blocks are the same expressions at other places. Differentiating and rewriting them is
most of the time of building a program, so it is done once for each expression.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import casadi as ca
import numpy as np

from kemba.cache import Recent
from kemba.ocp.functions.constants import parameterised
from kemba.ocp.functions.settings import Functions
from kemba.ocp.functions.signs import canonical_signs
from kemba.ocp.functions.vectorised import vectorised


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
