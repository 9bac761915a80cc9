"""Where the effect states of a model come to rest while its motion and commands are held."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np

from kemba.errors import KembaError
from kemba.model.model import Model
from kemba.model.node import Node
from kemba.quantity import Quantity

Array = np.ndarray[Any, np.dtype[np.float64]]

# s; ten times the recovery of a usual supply. Waiting for ever would be wrong: a leak empties any
# tank in the end, which a compressor fills again.
LONG = 3.0
STILL = 1e-6  # s-1; a state that moves by less of its scale is at rest
TOLERANCE = 1e-9  # of the integration, in the scales of the states


class Rest:
    """The states after a long wait: of ds/dt = rate(s, held) with `held` constant."""

    def __init__(
        self, s: ca.SX, held: Sequence[ca.SX], rate: ca.SX, quantities: Sequence[Quantity]
    ) -> None:
        self._start = np.array([q.value for q in quantities], dtype=float)
        self._scale = np.array([q.scale for q in quantities], dtype=float)
        if not quantities:
            return
        x, p = ca.SX.sym("x", s.numel()), ca.SX(ca.vertcat(*held))
        scaled = ca.substitute(rate, s, x * self._scale) / self._scale
        self._rate = ca.Function("rate", [x, p], [ca.densify(scaled)])
        options = {"abstol": TOLERANCE, "reltol": TOLERANCE}
        equation = {"x": x, "p": p, "ode": scaled}
        self._wait = ca.integrator("wait", "cvodes", equation, 0.0, LONG, options)

    def __call__(self, *held: Any) -> Array:
        """The states (ns,) with `held` in the order of the symbols; they begin at their nominal
        values. Raises KembaError where they explode."""
        if not len(self._start):
            return np.empty(0)
        x, p = self._start / self._scale, ca.vertcat(*(ca.DM(h) for h in held))
        moving = np.asarray(self._rate(x, p)).ravel()
        if np.all(np.abs(moving) <= STILL):
            return np.array(self._start)
        try:
            found = self._wait(x0=x, p=p)["xf"]
        except RuntimeError:
            what = "the states of its effects do not come to rest while everything is held"
            raise KembaError("model", what, hint="does an effect feed itself?") from None
        return np.asarray(np.asarray(found).ravel() * self._scale)


_KNOWN: WeakKeyDictionary[Model, Rest] = WeakKeyDictionary()


def at_rest(model: Model, q: Any, u: Any) -> Array:
    """Effect states (ns,) of a model at rest at coordinates q (nq,) and inputs u (nu,)."""
    if model not in _KNOWN:
        node = model.node
        still = ca.substitute(rate_of(node), node.v, ca.SX.zeros(node.v.numel()))
        _KNOWN[model] = Rest(node.s, [node.q, node.u], still, list(model.states.values()))
    return _KNOWN[model](q, u)


def rate_of(node: Node) -> ca.SX:
    """ds/dt (ns,) of a node, whose rows say sd - ds/dt = 0."""
    return -ca.substitute(node.rate, node.sd, ca.SX.zeros(node.sd.numel()))
