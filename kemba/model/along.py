"""Effect states of a model along a motion and inputs that are given."""

from __future__ import annotations

import casadi as ca
import numpy as np

from kemba.model.exponential import midpoint_step
from kemba.model.model import Model
from kemba.model.node import Node
from kemba.model.rest import Array, Buffered, Rest, rate_of

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
