"""What a rig's force should be, by its model, along a filtered log."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca
import numpy as np

from kemba.identify.problem.types import Array
from kemba.identify.rigs.filtering import Filtered
from kemba.model.exponential import midpoint_step
from kemba.model.model import Model
from kemba.model.rest import Rest, rate_of


class BalanceSettings:
    """Integration of the states that effects have, along a log."""

    chunk = 1000  # steps per call of a compiled function


class Balance:
    """A model with numbers left free: `free` parameters, `scaled` figures.

    The force is what the measured motion and the measured inputs demand. A cylinder: the force on
    the rod. A drive: the measured force of the motor, plus what the balance of forces lacks.
    """

    def __init__(self, model: Model, free: tuple[str, ...], scaled: tuple[str, ...]) -> None:
        self.model, self.names = model, (*free, *scaled)
        node = model.build(free, scaled)
        self.inputs = [q.name for q in model.inputs.values()]
        drive = model.mechanism.rig == "drive"
        force = node.dynamics[0] + node.u[0] if drive else node.outputs["piston/F"]
        symbols = [node.s, node.q, node.v, node.a, node.u, node.p]
        slopes = ca.horzcat(ca.jacobian(force, node.a), ca.jacobian(force, node.u))
        self._force = ca.Function("force", symbols, [ca.densify(force)])
        self._slopes = ca.Function("slopes", symbols, [ca.densify(slopes.T)])
        at_rest = ca.substitute(force, ca.vertcat(node.v, node.a), ca.DM.zeros(2))
        bends = ca.which_depends(at_rest, node.q, 2, True)[0]
        self._bends = bool(bends)
        self._static = ca.Function("static", symbols, [ca.densify(at_rest)])
        self._states = len(model.states)
        if self._states:
            rate = rate_of(node)
            self._rest = Rest(node.s, symbols[1:], rate, list(model.states.values()))
            given = ca.SX.sym("given", 4 + node.u.numel())
            at = [given[1], given[2], given[3], given[4:], node.p]
            after, _ = midpoint_step(rate, node.s, symbols[1:], at, given[0])
            step = ca.Function("step", [node.s, given, node.p], [ca.densify(after)])
            self._chunk = BalanceSettings.chunk
            self._step = step.mapaccum(self._chunk)

    def force(self, log: Filtered, values: Mapping[str, float]) -> Array:
        """Force (k,) at the judged rows; `values` holds every name of `names`."""
        found = np.asarray(self._force(*self._arguments(log, values))).ravel()
        return found + self._bent(log, values) if self._bends else found

    def slopes(self, log: Filtered, values: Mapping[str, float]) -> Array:
        """Slopes (k, 1 + inputs) of the force: by the acceleration and by each input."""
        found: Array = np.asarray(self._slopes(*self._arguments(log, values)))
        return np.asarray(found.T)

    def _bent(self, log: Filtered, values: Mapping[str, float]) -> Array:
        """What the force (k,) of the position is more behind the filter than at the position that
        is behind it."""
        p = np.array([values[name] for name in self.names]).reshape(-1, 1)
        u = np.stack([log.others[name] for name in self.inputs])
        rest = np.zeros((1, len(log.q)))
        s, fixed = np.zeros((self._states, len(log.q))), np.repeat(p, len(log.q), axis=1)
        read, behind = (
            np.asarray(self._static(s, q[None], rest, rest, u, fixed)).ravel()
            for q in (log.read, log.q)
        )
        return np.asarray((log.smoothed(read) - behind)[log.rows])

    def _arguments(self, log: Filtered, values: Mapping[str, float]) -> list[Array]:
        p = np.array([values[name] for name in self.names]).reshape(-1, 1)
        u = np.stack([log.others[name] for name in self.inputs])
        rows = log.rows
        s = self._along(log, u, p)[:, rows] if self._states else np.zeros((0, len(rows)))
        fixed = np.repeat(p, len(rows), axis=1)
        return [s, *(c[None, rows] for c in (log.q, log.v, log.a)), u[:, rows], fixed]

    def _along(self, log: Filtered, u: Array, p: Array) -> Array:
        """States (ns, n) along the whole log; each stretch begins at rest."""
        ends = np.append(log.begins[1:], len(log.time))
        parts = []
        for begin, end in zip(log.begins, ends, strict=True):
            own = slice(begin, end)
            s = self._rest(log.q[begin], 0.0, 0.0, u[:, begin], p)[:, None]
            middle = [0.5 * (c[own][1:] + c[own][:-1]) for c in (log.q, log.v, log.a, *u)]
            given = np.stack([np.diff(log.time[own]), *middle])
            count = given.shape[1]
            given = np.pad(given, ((0, 0), (0, -count % self._chunk)))  # steps of no length
            fixed = np.repeat(p, self._chunk, axis=1)
            found = [s]
            for i in range(0, given.shape[1], self._chunk):
                block = given[:, i : i + self._chunk]
                found.append(np.asarray(self._step(found[-1][:, -1:], block, fixed)))
            parts.append(np.concatenate(found, axis=1)[:, : count + 1])
        return np.concatenate(parts, axis=1)
