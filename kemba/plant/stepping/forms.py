"""The model's residual split into the parts that a time step needs.

The residual is affine in accelerations and forces: 0 = M(q) a - F - B lam. The parts are taken
by AD from the model's own expressions, so the plant has no physics of its own.
"""

from __future__ import annotations

from typing import Any

import casadi as ca

from kemba.errors import KembaError
from kemba.plant.stepping.pairs import read_pairs


class Forms:
    """Expressions of a node split into what a time step needs, as functions of (q, v, s, u)."""

    def __init__(self, node: Any) -> None:
        self.pairs = read_pairs(node)
        self.parts = M, F, B, f = _affine(node)
        state = [node.q, node.v, node.s, node.u]
        self.rows = {
            "W": self.pairs.W,
            "L": self.pairs.L,
            "w0": self.pairs.w0,
            "gap": self.pairs.gap,
        }
        self.smooth = ca.Function("smooth", state, [M, F, B, f])
        self.stiff = ca.Function("stiff", state, [ca.jacobian(F, node.v), ca.jacobian(f, node.s)])
        self.pair_rows = ca.Function("pairs", state, list(self.rows.values()))


def _affine(node: Any) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
    """M, F, B and f of a node. Raises KembaError where an effect breaks the affine form."""
    M, B = ca.jacobian(node.dynamics, node.a), -ca.jacobian(node.dynamics, node.lam)
    f = -ca.substitute([node.rate], [node.sd], [ca.SX.zeros(node.sd.numel())])[0]
    moving = ca.vertcat(node.a, node.lam, node.sd)
    for rows, form in ((node.dynamics_rows, ca.horzcat(M, B)), (node.rate_rows, f)):
        if form.numel() and any(ca.which_depends(ca.vec(ca.densify(form)), moving, 1, True)):
            raise KembaError(
                rows[0].label,
                "is not affine in accelerations and forces",
                "the plant steps only such models",
            )
    zero = [ca.SX.zeros(node.a.numel()), ca.SX.zeros(node.lam.numel())]
    bias = ca.substitute([node.dynamics], [node.a, node.lam], zero)[0]
    return M, -bias, B, f
