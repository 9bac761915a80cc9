"""The air in a vessel over time, by its model: a fixed-step integration, compiled."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca
import numpy as np

from kemba.identify.problem.types import Array
from kemba.model.exponential import midpoint_step
from kemba.model.model import Model
from kemba.model.rest import rate_of


class BlowDownSettings:
    """Integration of a blow-down."""

    steps = 2000  # steps over a log


class BlowDown:
    """A vessel's model with numbers left free: `free` parameters, `scaled` figures."""

    def __init__(self, model: Model, free: tuple[str, ...], scaled: tuple[str, ...]) -> None:
        self.names = (*free, *scaled)
        node = model.build(free, scaled)
        held = [node.q, node.v, node.a, node.u]
        still = [ca.SX.zeros(x.sparsity()) for x in held]
        rate = ca.substitute([rate_of(node)], held, still)[0]
        h = ca.SX.sym("h")
        after, _ = midpoint_step(rate, node.s, [node.p], [node.p], h)
        step = ca.Function("step", [node.s, h, node.p], [ca.densify(after)])
        self._count = BlowDownSettings.steps
        self._steps = step.mapaccum(self._count)

    def run(
        self, begin: float, end: float, start: Array, values: Mapping[str, float]
    ) -> tuple[Array, Array]:
        """Times (n,) [s] and states (2, n), P [Pa] and T [K], from `start` (2,)."""
        n, p = self._count, np.array([values[name] for name in self.names]).reshape(-1, 1)
        h = (end - begin) / n
        found = np.asarray(self._steps(start, np.full((1, n), h), np.repeat(p, n, axis=1)))
        states = np.concatenate([np.asarray(start, dtype=float)[:, None], found], axis=1)
        return np.asarray(begin + h * np.arange(n + 1)), states
