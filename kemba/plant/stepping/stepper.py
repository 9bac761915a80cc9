"""One step of the plant between events: stages, contact forces, and the impact law."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kemba.plant.stepping.arrays import Array
from kemba.plant.stepping.equations import Equations
from kemba.plant.stepping.lcp import solve_lcp

SOFT_REACH = 1e-3  # m; compliant gaps this close take part, whether they push or not


@dataclass
class State:
    """Coordinates q, velocities v and effect states s at a time [s]; `gap` (ng,) [m] and its
    rate [m/s] of every position pair."""

    time: float
    q: Array
    v: Array
    s: Array
    gap: Array
    rate: Array


class Stepper:
    """Steps the equations of a model; keeps the last contact modes as a warm start."""

    def __init__(self, equations: Equations) -> None:
        self.eq = equations
        self._active = np.zeros(equations.nl, dtype=bool)
        self._rows: dict[bytes, Array] = {}

    def touching(self, gap: Array, reach: float) -> Array:
        """Rows of the pair table that take part: gaps within `reach` [m] (compliant ones within
        `SOFT_REACH`) with the friction that belongs to them."""
        pairs = self.eq.pairs
        near = gap <= np.where(pairs.rigid, reach, SOFT_REACH)
        key = near.tobytes()
        if key not in self._rows:
            closed = np.zeros(self.eq.nl, dtype=bool)
            closed[pairs.gaps] = near
            friction = np.isin(pairs.group, pairs.group[closed]) & ~pairs.is_gap
            self._rows[key] = np.flatnonzero(closed | friction | pairs.ungapped)
        return self._rows[key]

    def hard(self, rows: Array) -> Array:
        """Those of `rows` that can pass on an impact: of instances with a rigid gap."""
        pairs = self.eq.pairs
        return rows[np.isin(pairs.group[rows], pairs.group[pairs.gaps[pairs.rigid]])]

    def step(self, now: State, u: Array, h: float, rows: Array) -> State:
        """The state after `h` [s] with the pairs `rows` held and the others left alone."""
        values = {"q": now.q, "v": now.v, "s": now.s, "u": u, "h": h}
        if not len(rows):
            end = self.eq.free(**values)
            return self._state(now.time + h, end, end["v"])
        start = self.eq.first(**values)
        lam = self._forces(rows, start["A"], start["b"])
        end = self.eq.second(**values, lam=lam)
        lam = self._forces(rows, end["A"], end["b"])
        return self._state(now.time + h, end, end["v"] + end["T"] @ lam)

    def place(self, time: float, q: Array, v: Array, s: Array, u: Array) -> State:
        """The state at given values."""
        P = self.eq.ahead(q=q, v=v, s=s, u=u)
        return self._state(time, {**P, "q": q, "s": s}, v)

    def impact(self, now: State, u: Array, rows: Array) -> tuple[State, Array, float]:
        """The state after an inelastic impact at the pairs `rows`, the impulses (nl,) [N.s], and
        the kinetic energy lost [J].

        Energy cannot grow: the impulses work against the velocity after them.
        """
        E = self.eq.now(q=now.q, v=now.v, s=now.s, u=u)
        T = np.linalg.solve(E["M"], E["B"])
        impulse = self._forces(rows, E["W"] @ T + E["L"], E["W"] @ now.v)
        v = now.v + T @ impulse
        lost = 0.5 * float((now.v - v) @ E["M"] @ (now.v + v))
        return self._state(now.time, {**E, "q": now.q, "s": now.s}, v), impulse, lost

    def instant(self, now: State, u: Array, rows: Array, h: float) -> tuple[Array, Array]:
        """Accelerations (n,) and forces (nl,) [N] just after `now`.

        The forces are those that hold the pairs over a short `h` [s].
        """
        E = self.eq.now(q=now.q, v=now.v, s=now.s, u=u)
        solved = np.linalg.solve(E["M"], np.column_stack([E["F"], E["B"]]))
        a, T = solved[:, 0], solved[:, 1:]
        if not len(rows):
            return a, np.zeros(self.eq.nl)
        P, soft = self.eq.ahead(q=now.q + h * now.v, v=now.v, s=now.s, u=u), self.eq.pairs.compliant
        W, L, w0 = P["W"], P["L"].copy(), P["w0"].copy()
        L[soft], w0[soft] = E["L"][soft], E["w0"][soft]
        b = W @ (now.v + h * a) + w0
        b[self.eq.pairs.gaps] -= np.minimum(now.rate, 0.0)  # touching at rest, not hitting
        lam = self._forces(rows, W @ (h * T) + L, b)
        return a + T @ lam, lam

    def _forces(self, rows: Array, A: Array, b: Array) -> Array:
        lam = np.zeros(self.eq.nl)
        if len(rows):
            lam[rows], self._active[rows] = solve_lcp(A[rows][:, rows], b[rows], self._active[rows])
        return lam

    def _state(self, time: float, at: dict[str, Array], v: Array) -> State:
        rate = at["W"][self.eq.pairs.gaps] @ v
        return State(time, at["q"].copy(), v.copy(), at["s"].copy(), at["gap"].copy(), rate)
