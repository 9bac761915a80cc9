"""A step of the effect states along an imposed motion, as expressions: ROS2, see `kernel.step`."""

from __future__ import annotations

import casadi as ca

from kemba.plant.kernel.settings import GAMMA
from kemba.plant.stepping.forms import Forms

Symbols = dict[str, ca.SX]


def impose(forms: Forms, at: Symbols) -> tuple[Symbols, Symbols]:
    """A step of the effect states from (q, v) to imposed (q1, v1): inputs and outputs."""
    s, u, h = at["s"], at["u"], ca.SX.sym("h")
    q1, v1 = ca.SX.sym("q1", at["q"].numel()), ca.SX.sym("v1", at["v"].numel())
    f = forms.rates(at["q"], at["v"], s, u)
    left = ca.SX.eye(s.numel()) - GAMMA * h * forms.stiff_rates(at["q"], at["v"], s, u)
    k1 = eliminate(left, f)
    f1 = forms.rates(q1, v1, s + h * k1, u)
    k2 = eliminate(left, f1 - 2 * k1)
    return {**at, "q1": q1, "v1": v1, "h": h}, {"s": s + h * (3 * k1 + k2) / 2}


def eliminate(A: ca.SX, B: ca.SX) -> ca.SX:
    """Solution X of A X = B by elimination without pivoting, as an expression.

    For matrices whose symmetric part is positive definite, as inertia with dissipation is.
    """
    A, B = ca.densify(A), ca.densify(B)
    n = A.shape[0]
    for k in range(n):
        for i in range(k + 1, n):
            ratio = A[i, k] / A[k, k]
            A[i, k + 1 :] -= ratio * A[k, k + 1 :]
            B[i, :] -= ratio * B[k, :]
    for k in reversed(range(n)):
        B[k, :] = (B[k, :] - ca.mtimes(A[k, k + 1 :], B[k + 1 :, :])) / A[k, k]
    return B
