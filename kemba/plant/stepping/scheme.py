"""The plant's integration scheme as expressions: linearly implicit, second order, with contact.

ROS2 as a W-method (Verwer, Spee, Blom, Hundsdorfer, SIAM J. Sci. Comput. 20, 1999): second order
for any approximate Jacobian, L-stable for an exact one. Only the stiff blocks enter it, damping
D = dF/dv and the effect states' own A = df/ds; positions then follow by the trapezoidal rule.

    (M - g h D) k1 = F + B lam1                     v1 = v + h k1
    (M - g h D) k2 = M (M1^-1 (F1 + B1 lam2) - 2 k1)   v2 = v + h (3 k1 + k2) / 2

Closed contacts are held at velocity level at the end of both stages, as half-explicit Runge-Kutta
methods do for index 2; lam1 and lam2 solve small complementarity problems w = A lam + b.
"""

from __future__ import annotations

import casadi as ca

from kemba.plant.stepping.compiled import eliminate
from kemba.plant.stepping.forms import Forms

Symbols = dict[str, ca.SX]
GAMMA = 1.0 - 0.5**0.5
PULL_BACK = 0.2  # share of a gap's drift that one step removes
SHORTEST = 1e-5  # s; pulling back within less would turn rounding into speed
FASTEST = 0.05  # m/s; a foot that starts below the ground comes out no faster


def first_stage(forms: Forms, at: Symbols) -> Symbols:
    """Complementarity problem w = A lam + b of the first stage."""
    h = at["h"]
    k1, T, _, _ = _first(forms, at)
    W, L, w0, _ = _pairs(forms, at, (at["q"] + h * at["v"], at["v"], at["s"], at["u"]))
    return {"A": W @ (h * T) + L, "b": W @ (at["v"] + h * k1) + w0}


def second_stage(forms: Forms, at: Symbols) -> Symbols:
    """State after the step for given first forces `lam`, but for the second forces: v + T lam2.

    With their complementarity problem w = A lam2 + b, the gaps and their Jacobian in W.
    """
    q, v, s, u, h = (at[key] for key in ("q", "v", "s", "u", "h"))
    k1, T, left, M = _first(forms, at)
    k1 = k1 + T @ at["lam"]
    q1, v1 = q + h * v, v + h * k1
    f, A_s = forms.smooth(q, v, s, u)[3], forms.stiff(q, v, s, u)[1]
    s_left = ca.SX.eye(s.numel()) - GAMMA * h * A_s
    ks1 = eliminate(s_left, f)
    M1, F1, B1, f1 = forms.smooth(q1, v1, s + h * ks1, u)
    ks2 = eliminate(s_left, f1 - 2 * ks1)
    inner = eliminate(M1, ca.horzcat(F1, B1))
    right = M @ ca.horzcat(inner[:, 0] - 2 * k1, inner[:, 1:])
    outer = eliminate(left, right)
    q2, v2 = q + h * (v + v1) / 2, v + h * (3 * k1 + outer[:, 0]) / 2
    s2 = s + h * (3 * ks1 + ks2) / 2
    T = h / 2 * outer[:, 1:]
    middle = {"q": q1, "v": v1, "s": s + h * ks1, "u": u}
    W, L, w0, gap = _pairs(forms, middle, (q2, v1, s2, u))
    for i, row in enumerate(forms.pairs.gaps):
        if forms.pairs.rigid[i]:
            w0[int(row)] += ca.fmax(PULL_BACK * gap[i] / ca.fmax(h, SHORTEST), -FASTEST)
    return {
        "q": q2, "v": v2, "s": s2, "T": T, "A": W @ T + L, "b": W @ v2 + w0, "gap": gap, "W": W,
    }  # fmt: skip


def _pairs(forms: Forms, at: Symbols, end: tuple[ca.SX, ...]) -> tuple[ca.SX, ...]:
    """Pairs as they shall hold at the `end` of a stage; a compliant gap pushes with the force of
    the state `at` which the stage is evaluated, like any smooth force."""
    W, L, w0, gap = forms.pair_rows(*end)
    if len(forms.pairs.compliant):
        _, L_at, w0_at, _ = forms.pair_rows(at["q"], at["v"], at["s"], at["u"])
        for row in forms.pairs.compliant:
            L[int(row), :], w0[int(row)] = L_at[int(row), :], w0_at[int(row)]
    return W, L, w0, gap


def _first(forms: Forms, at: Symbols) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
    """Free acceleration, acceleration per force, implicit matrix and inertia of stage one."""
    state = [at[key] for key in ("q", "v", "s", "u")]
    M, F, B, _ = forms.smooth(*state)
    left = M - GAMMA * at["h"] * forms.stiff(*state)[0]
    both = eliminate(left, ca.horzcat(F, B))
    return both[:, 0], both[:, 1:], left, M


def impose(forms: Forms, at: Symbols) -> tuple[Symbols, Symbols]:
    """A step of the effect states from (q, v) to imposed (q1, v1): inputs and outputs."""
    s, u, h = at["s"], at["u"], ca.SX.sym("h")
    q1, v1 = ca.SX.sym("q1", at["q"].numel()), ca.SX.sym("v1", at["v"].numel())
    f = forms.smooth(at["q"], at["v"], s, u)[3]
    left = ca.SX.eye(s.numel()) - GAMMA * h * forms.stiff(at["q"], at["v"], s, u)[1]
    k1 = eliminate(left, f)
    f1 = forms.smooth(q1, v1, s + h * k1, u)[3]
    k2 = eliminate(left, f1 - 2 * k1)
    return {**at, "q1": q1, "v1": v1, "h": h}, {"s": s + h * (3 * k1 + k2) / 2}
