"""Advancing through contact events: touchdowns end a step, impacts are inelastic."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from kemba.plant.kernel.forces import touching
from kemba.plant.kernel.impact import impact
from kemba.plant.kernel.jit import kernel
from kemba.plant.kernel.machine import Machine, Memory, State
from kemba.plant.kernel.root import first_root
from kemba.plant.kernel.step import step
from kemba.plant.stepping.arrays import Array

CLOSED = 1e-6  # m; a gap below this counts as touching
MISSED = 1e-8  # m; a touchdown located worse than this is searched again
MANY, REACH = 12, 2e-5  # events within one step after which gaps close at a distance [m]
MOST = 10 * MANY  # events within one step
NO_TIME = 1e-12  # s
NOTICED = 1e-9  # N.s; a smaller impulse is no impact


class Impacts(NamedTuple):
    """The impacts so far: how many, and by row time [s], energy lost [J] and impulses (nl,)."""

    count: Array
    time: Array
    lost: Array
    impulse: Array


@kernel
def advance(
    m: Machine, k: Memory, now: State, spare: State, until: float, longest: float, log: Impacts
) -> bool:
    """Carry `now` on to `until` [s] in steps of up to `longest` [s], with `spare` as memory.

    False when it stops earlier because `log` is nearly full.
    """
    while until - now.time[0] > NO_TIME:
        if log.count[0] + MOST > len(log.time):
            return False
        left = until - now.time[0]
        steps = max(1, int(np.ceil(left / longest - 1e-6)))
        _step(m, k, now, spare, left / steps, log)
    now.time[0] = until
    return True


@kernel
def collide(m: Machine, k: Memory, now: State, reach: float, log: Impacts) -> None:
    """An impact at everything that touches."""
    rows = touching(m, now.gap, reach)
    rows = rows[m.hard[rows]]
    if not len(rows):
        return
    at = log.count[0]
    lost = impact(m, k, now, rows, log.impulse[at])
    for row in m.gaps:
        if log.impulse[at, row] > NOTICED:
            log.time[at], log.lost[at] = now.time[0], lost
            log.count[0] = at + 1
            return


@kernel
def _step(m: Machine, k: Memory, now: State, spare: State, h: float, log: Impacts) -> None:
    """One step of `h` [s], interrupted where a gap closes."""
    end = now.time[0] + h
    for event in range(MOST):
        reach = CLOSED if event < MANY else REACH
        touched = _until_touch(m, k, now, spare, end - now.time[0], reach)
        _copy(spare, now)
        if touched:
            collide(m, k, now, reach, log)
        if end - now.time[0] <= NO_TIME:
            return


@kernel
def _until_touch(m: Machine, k: Memory, now: State, new: State, h: float, reach: float) -> bool:
    """`new` is the state after `h`, or at the first touch of a gap that is open now; whether
    something touches."""
    rows = touching(m, now.gap, reach)
    step(m, k, now, h, rows, new)
    may_hit = (now.gap > reach) & m.rigid
    through = (new.gap < 0.0) & may_hit
    if not through.any():
        return ((new.gap <= reach) & (new.rate < 0.0) & may_hit).any()
    for _ in range(4):
        length, best, first = new.time[0] - now.time[0], np.inf, 0
        for i in range(len(through)):
            if through[i]:
                slope = (new.gap[i] - now.gap[i]) / length
                time = length * first_root(
                    now.gap[i], now.rate[i] * length, new.rate[i] * length, slope * length
                )
                if time < best:
                    best, first = time, i
        step(m, k, now, max(best, 1e-9), rows, new)
        through = (new.gap < -MISSED) & may_hit
        through[first] = abs(new.gap[first]) > MISSED
        if not through.any():
            break
    return True


@kernel
def _copy(source: State, target: State) -> None:
    target.time[0] = source.time[0]
    target.y[:] = source.y
    target.gap[:] = source.gap
    target.rate[:] = source.rate
