"""A model's residual split into what a time step needs: 0 = M(q) a - F - B lam, s' = f."""

from __future__ import annotations

import casadi as ca

from kemba.errors import KembaError
from kemba.model.node import Node
from kemba.plant.stepping.pairs import read_pairs


class Forms:
    """Expressions of a node's q, v, s, u and p, and the functions that evaluate them elsewhere.

    `parts`: M (n, n), F (n,), B (n, nl), f (ns,). `D` (n, n) = dF/dv and `A` (ns, ns) = df/ds are
    the stiff blocks. `pairs`: the complementarity pairs.
    Raises KembaError where an effect breaks the affine form.
    """

    def __init__(self, node: Node) -> None:
        self.pairs = read_pairs(node)
        self.parts = _affine(node)
        _, F, _, f = self.parts
        self.D, self.A = ca.jacobian(F, node.v), ca.jacobian(f, node.s)
        state = [node.q, node.v, node.s, node.u]
        self.rates = ca.Function("rates", state, [f], {"allow_free": True})
        self.stiff_rates = ca.Function("stiff_rates", state, [self.A], {"allow_free": True})


def _affine(node: Node) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
    """M, F, B and f of a node."""
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
