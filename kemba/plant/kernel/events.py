"""Advancing through contact events: touchdowns end a step, impacts are inelastic."""

from __future__ import annotations

from math import ceil
from typing import NamedTuple

from kemba.plant.kernel.algebra.root import first_root
from kemba.plant.kernel.forces import touching
from kemba.plant.kernel.impact import impact
from kemba.plant.kernel.jit import kernel, part
from kemba.plant.kernel.machine import KernelModel, Memory, State
from kemba.plant.kernel.pace import Pace, keeps_pace
from kemba.plant.kernel.settings import ContactEvents
from kemba.plant.kernel.step import step
from kemba.plant.stepping.arrays import Array

_EVENTS = ContactEvents.current()
CLOSED, MISSED, SEARCHES = _EVENTS.closed, _EVENTS.missed, _EVENTS.searches
MANY, REACH, MOST = _EVENTS.many, _EVENTS.reach, _EVENTS.most
NO_TIME, NOTICED = _EVENTS.soonest, _EVENTS.noticed
FREE, TOUCHED, TOO_LONG = 0, 1, 2  # how a step ends


class Impacts(NamedTuple):
    """The impacts so far: how many, and by row time [s], energy lost [J], impulses (nl,) [N.s] and
    rates (ng,) [m/s] of the gaps just before."""

    number: Array
    time: Array
    lost: Array
    impulse: Array
    rate: Array


@part
def advance(
    m: KernelModel, k: Memory, now: State, spare: State, until: float, pace: Pace, log: Impacts
) -> bool:
    """Simulate from `now` to the time `until` [s]; `now` is changed, `spare` is used as memory.

    Gives False when it stops earlier because `log` is nearly full.
    """
    while until - now.time[0] > NO_TIME:
        if log.number[0] + MOST > len(log.time):
            return False
        left = until - now.time[0]
        steps = max(1.0, ceil(left / pace.step[0] - 1e-6))
        end = now.time[0] + left / steps
        for event in range(MOST):
            reach = CLOSED if event < MANY else REACH
            what = _until_touch(m, k, now, spare, end - now.time[0], reach, pace)
            if what == TOUCHED:
                collide(m, k, now, reach, log)
            if what == TOO_LONG or end - now.time[0] <= NO_TIME:
                break
    now.time[0] = until
    return True


@kernel
def collide(m: KernelModel, k: Memory, now: State, reach: float, log: Impacts) -> None:
    """An impact at everything that touches: of instances with a rigid gap."""
    count, at = 0, log.number[0]
    for i in range(touching(m, k, now.gap, reach)):
        if m.hard[k.rows[i]]:
            k.rows[count] = k.rows[i]
            count += 1
    if count == 0:
        return
    for i in range(len(m.gaps)):
        log.rate[at, i] = now.rate[i]
    log.time[at], log.lost[at] = now.time[0], impact(m, k, now, count)
    for row in range(m.nl):
        log.impulse[at, row] = 0.0
    for i in range(count):
        log.impulse[at, k.rows[i]] = k.lcp.z[i]
    for i in range(len(m.gaps)):
        if log.impulse[at, m.gaps[i]] > NOTICED:
            log.number[0] = at + 1
            return


@part
def _until_touch(
    m: KernelModel, k: Memory, now: State, new: State, h: float, reach: float, pace: Pace
) -> int:
    """One step: `now` becomes the state after `h` [s], or at the first touch of an open gap.

    Gives TOUCHED where something touches, else FREE; TOO_LONG where the step must be shorter, and
    then `now` does not change.
    """
    count = touching(m, k, now.gap, reach)
    if not keeps_pace(pace, h, step(m, k, now, h, count, new)):
        return TOO_LONG
    through, near = False, False
    for i in range(len(m.gaps)):
        may_hit = m.rigid[i] and now.gap[i] > reach
        k.hits[i] = may_hit and new.gap[i] < 0.0
        through |= k.hits[i]
        near |= may_hit and new.gap[i] <= reach and new.rate[i] < 0.0
    for _ in range(SEARCHES):
        if not through:
            break
        near = True
        first, time = _first_hit(m, k, now, new)
        step(m, k, now, max(time, 1e-9), count, new)
        through = False
        for i in range(len(m.gaps)):
            may_hit = m.rigid[i] and now.gap[i] > reach
            k.hits[i] = may_hit and new.gap[i] < -MISSED
            if i == first:
                k.hits[i] = abs(new.gap[i]) > MISSED
            through |= k.hits[i]
    now.time[0] = new.time[0]
    for i in range(len(now.y)):
        now.y[i] = new.y[i]
    for i in range(len(m.gaps)):
        now.gap[i], now.rate[i] = new.gap[i], new.rate[i]
    return TOUCHED if near else FREE


@part
def _first_hit(m: KernelModel, k: Memory, now: State, new: State) -> tuple[int, float]:
    """Which of the gaps `k.hits` closes first, and how long [s] after `now`."""
    length, first, soonest = new.time[0] - now.time[0], -1, 1e300
    for i in range(len(m.gaps)):
        if k.hits[i]:
            rise = new.gap[i] - now.gap[i]
            rates = now.rate[i] * length, new.rate[i] * length
            time = length * first_root(now.gap[i], rates[0], rates[1], rise)
            if first < 0 or time < soonest:
                first, soonest = i, time
    return first, soonest
