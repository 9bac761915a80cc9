"""Effect states of a model along a motion and inputs that are given: the exponential midpoint rule.

Second order, exact for a lag of constant input however short, and stable where the states are
stiff: air that flows between nearly equal pressures answers within a fifth of a millisecond.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from kemba.model.model import Model, Node
from kemba.model.rest import Array, Buffered, Rest, rate_of


def midpoint_step(
    rate: ca.SX, s: ca.SX, inputs: Sequence[ca.SX], given: Sequence[ca.SX], h: ca.SX
) -> tuple[ca.SX, ca.SX]:
    """States (ns,) after a step h [s] from s, and their mean over it, by ds/dt = rate(s, inputs)
    with the inputs held at `given`, their values in the middle of the step."""
    f = ca.Function("f", [s, *inputs], [rate, ca.diag(ca.jacobian(rate, s))])
    middle = s + _grown(h / 2, *f(s, *given))
    slope, stiff = f(middle, *given)
    slope = slope - stiff * (middle - s)
    return s + _grown(h, slope, stiff), s + _mean_growth(h, slope, stiff)


def _grown(h: ca.SX, slope: ca.SX, stiff: ca.SX) -> ca.SX:
    """h phi(h stiff) slope with phi(z) = (exp(z) - 1)/z."""
    z = h * stiff
    small = ca.fabs(z) < 1e-6
    return h * slope * ca.if_else(small, 1 + z / 2, (ca.exp(z) - 1) / ca.if_else(small, 1, z))


def _mean_growth(h: ca.SX, slope: ca.SX, stiff: ca.SX) -> ca.SX:
    """Mean of the growth over the step: h slope (exp(z) - 1 - z)/z^2."""
    z = h * stiff
    small = ca.fabs(z) < 1e-3
    safe = ca.if_else(small, 1, z)
    return h * slope * ca.if_else(small, 0.5 + z / 6, (ca.exp(z) - 1 - z) / safe**2)


CHUNK = 512  # steps per call of the compiled function


class StatesAlong:
    """The states of a model's `node`, step by step. `rest`: where they come to rest, by coordinate,
    its rate and acceleration, inputs and parameters that are held."""

    def __init__(self, model: Model, node: Node) -> None:
        held, rate = [node.q, node.v, node.a, node.u, node.p], rate_of(node)
        self.rest = Rest(node.s, held, rate, list(model.states.values()))
        sizes = [1, *(symbol.numel() for symbol in held[:-1])]
        self.width = sum(sizes)
        d = ca.SX.sym("d", self.width)
        h, *given = ca.vertsplit(d, np.cumsum([0, *sizes]).tolist())
        after, _ = midpoint_step(rate, node.s, held, [*given, node.p], h)
        step = ca.Function("step", [node.s, d, node.p], [ca.densify(after)], {"cse": True})
        self._steps = Buffered(step.mapaccum(CHUNK))

    def run(self, start: Array, given: Array, p: Array) -> Array:
        """States (ns, n + 1) from `start` (ns,) over n steps, at parameters p (k,). `given`
        (width, n): length [s] of each step; coordinates, rates, accelerations and inputs in its
        middle."""
        n = given.shape[1]
        given = np.pad(given, ((0, 0), (0, -n % CHUNK)))  # steps of no length at the end
        fixed, states = np.repeat(p[:, None], CHUNK, axis=1), [start[:, None]]
        for i in range(0, given.shape[1], CHUNK):
            (found,) = self._steps(states[-1][:, -1], given[:, i : i + CHUNK], fixed)
            states.append(found.copy())
        return np.concatenate(states, axis=1)[:, : n + 1]
