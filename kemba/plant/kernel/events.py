"""Advancing through contact events: touchdowns end a step, impacts are inelastic."""

from math import ceil, copysign, sqrt
from typing import NamedTuple

from kemba.plant.kernel.contact import impact, touching
from kemba.plant.kernel.jit import kernel, part
from kemba.plant.kernel.machine import Array, KernelModel, Memory, State
from kemba.plant.kernel.step import Pace, keeps_pace, step

BEYOND = 1.5  # steps: how far behind the end of a step a touchdown may be looked for


@part
def first_root(gap: float, rate: float, end: float, rise: float) -> float:
    """First zero in (0, `BEYOND`], in steps, of the cubic through a gap and its rate per step at
    both ends of a step; `rise` is how much the gap grows.

    Where the cubic has none the secant answers.
    """
    c1, c2, c3 = rate, 3.0 * rise - 2.0 * rate - end, rate + end - 2.0 * rise
    early, late = BEYOND, BEYOND  # the extrema: between them the cubic is monotonous
    discriminant = c2 * c2 - 3.0 * c3 * c1
    if discriminant > 0.0:
        far = -(c2 + copysign(sqrt(discriminant), c2))
        early, late = c1 / far, far / (3.0 * c3)
    if early > late:
        early, late = late, early
    low, above = 0.0, gap > 0.0
    for border in (early, late, BEYOND):
        if 0.0 < border <= BEYOND:
            if (gap + border * (c1 + border * (c2 + border * c3)) > 0.0) != above:
                return _between(gap, c1, c2, c3, low, border)
            low = border
    return -gap / rise


@part
def _between(c0: float, c1: float, c2: float, c3: float, low: float, high: float) -> float:
    """The zero of a monotonous cubic from `low` to `high`, by Newton's method held between."""
    upwards = c0 + high * (c1 + high * (c2 + high * c3)) > 0.0
    x = 0.5 * (low + high)
    for _ in range(60):
        value = c0 + x * (c1 + x * (c2 + x * c3))
        if (value > 0.0) == upwards:
            high = x
        else:
            low = x
        slope = c1 + x * (2.0 * c2 + x * 3.0 * c3)
        new = x - value / slope
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - x) <= 1e-15:
            break
        x = new
    return x


CLOSED = 1e-6  # m; a smaller gap touches (far above rounding errors)
MISSED = 1e-8  # m; a touchdown that is located worse is searched again (far above rounding errors)
SEARCHES = 4  # searches of one touchdown
MANY = 12  # events of one step after which gaps close sooner
REACH = 2e-5  # m; gap that touches from then on
MOST = 120  # events of one step (ten times `many`)
NO_TIME = 1e-12  # s; a shorter time is none (far above rounding errors)
NOTICED = 1e-9  # N.s; a smaller impulse is no impact (far above rounding errors)
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
