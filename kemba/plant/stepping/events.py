"""Advancing through contact events: touchdowns end a step, impacts are inelastic."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial

from kemba.plant.stepping.arrays import Array
from kemba.plant.stepping.equations import Equations
from kemba.plant.stepping.stepper import State, Stepper

CLOSED = 1e-6  # m; a gap below this counts as touching
MISSED = 1e-8  # m; a touchdown located worse than this is searched again
MANY, REACH = 12, 2e-5  # events within one step after which gaps close at a distance [m]
NO_TIME = 1e-12  # s


@dataclass(frozen=True)
class Impact:
    """An inelastic impact: when [s], at which pairs, its largest impulse [N.s], and the kinetic
    energy lost [J]."""

    time: float
    labels: tuple[str, ...]
    impulse: float
    lost: float


class Advance:
    """Carries a state forward with inputs `u` (nu,) that are held until changed."""

    def __init__(self, equations: Equations, step: float) -> None:
        self.eq, self.longest = equations, step
        self.stepper = Stepper(equations)
        self.impacts: list[Impact] = []
        self.u = np.zeros(equations.nu)

    def begin(self, time: float, q: Array, v: Array, s: Array) -> State:
        """The state at given values, after what touches has stopped."""
        return self._collide(self.stepper.place(time, q, v, s, self.u), CLOSED)

    def to(self, now: State, until: float) -> State:
        """The state at `until` [s]."""
        while (left := until - now.time) > NO_TIME:
            steps = max(1, int(np.ceil(left / self.longest - 1e-6)))
            now = self._step(now, left / steps)
        now.time = until
        return now

    def rows(self, now: State, reach: float = CLOSED) -> Array:
        """Rows of the pair table that are touching."""
        return self.stepper.touching(now.gap, reach)

    def _step(self, now: State, h: float) -> State:
        """One step of `h` [s], interrupted where a gap closes."""
        end = now.time + h
        for event in range(10 * MANY):
            reach = CLOSED if event < MANY else REACH
            now, touched = self._until_touch(now, end - now.time, reach)
            if touched:
                now = self._collide(now, reach)
            if end - now.time <= NO_TIME:
                break
        return now

    def _until_touch(self, now: State, h: float, reach: float) -> tuple[State, bool]:
        """The state after `h`, or at the first touch of a gap that is open now."""
        rows = self.rows(now, reach)
        new = self.stepper.step(now, self.u, h, rows)
        may_hit = (now.gap > reach) & self.eq.pairs.rigid
        through = (new.gap < 0.0) & may_hit
        if not through.any():
            return new, bool(((new.gap <= reach) & (new.rate < 0.0) & may_hit).any())
        for _ in range(4):
            length = new.time - now.time
            hits = np.flatnonzero(through)
            times = [_root(now, new, int(i), length) for i in hits]
            first, length = hits[int(np.argmin(times))], max(min(times), 1e-9)
            new = self.stepper.step(now, self.u, length, rows)
            through = (new.gap < -MISSED) & may_hit
            through[first] = abs(new.gap[first]) > MISSED
            if not through.any():
                break
        return new, True

    def _collide(self, now: State, reach: float) -> State:
        """The state after an impact at everything that touches."""
        rows = self.stepper.hard(self.rows(now, reach))
        if not len(rows):
            return now
        new, impulse, lost = self.stepper.impact(now, self.u, rows)
        gaps = self.eq.pairs.gaps
        hit = gaps[impulse[gaps] > 1e-9]
        if len(hit):
            labels = tuple(self.eq.pairs.labels[i] for i in hit)
            self.impacts.append(Impact(now.time, labels, float(impulse[hit].max()), lost))
        return new


def _root(now: State, new: State, i: int, h: float) -> float:
    """First zero [s] of the cubic through gap `i` and its rate at both ends of a step.

    Where the cubic has none the secant answers; beyond the step it extrapolates.
    """
    gap, rate, end = float(now.gap[i]), float(now.rate[i]), float(new.rate[i])
    slope = (float(new.gap[i]) - gap) / h
    cubic = Polynomial(
        [gap, rate * h, (3 * slope - 2 * rate - end) * h, (rate + end - 2 * slope) * h]
    )
    roots = cubic.roots()
    real = roots[np.abs(roots.imag) < 1e-9].real
    inside = real[(real > 0.0) & (real <= 1.5)]
    return h * float(inside.min()) if len(inside) else -gap / slope
