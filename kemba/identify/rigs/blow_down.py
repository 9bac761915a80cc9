"""The air in a vessel over time, by its model: a fixed-step integration, compiled."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca
import numpy as np

from kemba.identify.problem.types import Array
from kemba.model.model import Model
from kemba.model.rest import rate_of
from kemba.settings import BY_HAND, Settings, setting


class BlowDownSettings(Settings):
    """Integration of a blow-down."""

    steps: int = setting(400, "1", "steps of the classic Runge-Kutta rule over a log", BY_HAND)


class BlowDown:
    """A vessel's model with numbers left free: `free` parameters, `scaled` figures."""

    def __init__(self, model: Model, free: tuple[str, ...], scaled: tuple[str, ...]) -> None:
        self.names = (*free, *scaled)
        node = model.build(free, scaled)
        held = [node.q, node.v, node.a, node.u]
        still = [ca.SX.zeros(x.sparsity()) for x in held]
        rate = ca.substitute([rate_of(node)], held, still)[0]
        f = ca.Function("f", [node.s, node.p], [rate])
        s, h, p = ca.SX.sym("s", node.s.numel()), ca.SX.sym("h"), node.p
        k1 = f(s, p)
        k2 = f(s + h / 2 * k1, p)
        k3 = f(s + h / 2 * k2, p)
        k4 = f(s + h * k3, p)
        step = ca.Function("step", [s, h, p], [s + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)])
        self._count = BlowDownSettings.current().steps
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
