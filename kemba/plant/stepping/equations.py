"""The model's residual as the stepper needs it: one compiled function per stage.

The residual is affine in accelerations and forces: 0 = M(q) a - F - B lam. The parts are taken
by AD from the model's own expressions, so the plant has no physics of its own.
"""

from __future__ import annotations

from typing import Any
from weakref import WeakKeyDictionary

import casadi as ca

from kemba.errors import KembaError
from kemba.model import Model
from kemba.plant.stepping.compiled import Compiled
from kemba.plant.stepping.pairs import PairTable, read_pairs
from kemba.plant.stepping.scheme import first_stage, impose, second_stage


class Equations:
    """Compiled functions of a model and the structure of its complementarity pairs.

    `now(q, v, s, u)`: M (n, n), F (n,), B (n, nl) and the pairs w = W v + L lam + w0 at a state.
    `ahead(q, v, s, u)`: the same pairs only. `first`, `second`, `free`: stages of a step, see
    `scheme`. `driven`: a step of the effect states when the motion is imposed. `measure`: outputs.
    """

    def __init__(self, model: Model) -> None:
        node = model.node
        self.node = node
        self.n, self.ns = node.q.numel(), node.s.numel()
        self.nl, self.nu = node.lam.numel(), node.u.numel()
        forms = Forms(node)
        self.pairs: PairTable = forms.pairs
        symbols = {key: getattr(node, key) for key in ("q", "v", "a", "s", "sd", "lam", "u")}
        columns = [node.outputs[o.name] for o in node.output_quantities]
        self.measure = Compiled("measure", symbols, {"y": ca.SX(ca.vertcat(*columns))})
        state = {key: symbols[key] for key in ("q", "v", "s", "u")}
        if model.mechanism.imposed:
            self.driven = Compiled("driven", *impose(forms, state))
            return
        now = dict(zip(("M", "F", "B", "f"), forms.parts, strict=True))
        self.now = Compiled("now", state, {**now, **forms.rows})
        self.ahead = Compiled("ahead", state, forms.rows)
        step = {**state, "h": ca.SX.sym("h")}
        self.first = Compiled("first", step, first_stage(forms, step))
        lam = {**step, "lam": ca.SX.sym("lam", self.nl)}
        self.second = Compiled("second", lam, second_stage(forms, lam))
        free = second_stage(forms, {**step, "lam": ca.SX.zeros(self.nl)})
        wanted = ("q", "v", "s", "gap", "W")
        self.free = Compiled("free", step, {key: free[key] for key in wanted})


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


_KNOWN: WeakKeyDictionary[Model, Equations] = WeakKeyDictionary()


def equations_of(model: Model) -> Equations:
    """The equations of a model, compiled once."""
    if model not in _KNOWN:
        _KNOWN[model] = Equations(model)
    return _KNOWN[model]


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
