"""The model's residual as the stepper needs it: one compiled function per stage.

See `forms` for the parts of the residual and `scheme` for the stages.
"""

from __future__ import annotations

from weakref import WeakKeyDictionary

import casadi as ca

from kemba.model import Model
from kemba.plant.stepping.compiled import Compiled
from kemba.plant.stepping.forms import Forms
from kemba.plant.stepping.pairs import PairTable
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


_KNOWN: WeakKeyDictionary[Model, Equations] = WeakKeyDictionary()


def equations_of(model: Model) -> Equations:
    """The equations of a model, compiled once."""
    if model not in _KNOWN:
        _KNOWN[model] = Equations(model)
    return _KNOWN[model]
