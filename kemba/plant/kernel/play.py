"""A whole simulation: from mark to mark, inputs, controller, impacts and record."""

from math import isfinite, isnan
from typing import NamedTuple

from kemba.plant.kernel.contact import evaluate, evaluate_pairs, instant, set_gaps, touching
from kemba.plant.kernel.events import CLOSED, Impacts, advance, collide
from kemba.plant.kernel.jit import entry, part
from kemba.plant.kernel.machine import Array, KernelModel, Memory, State
from kemba.plant.kernel.step import Pace


class Law(NamedTuple):
    """tau = K_p (q_d - q) + K_d (w_d - w) + tau_ff of some joints, within what the motors give.

    By joint: `angle` and `speed`, places in `State.y`; `torque`, place in x; `limits` (joints, 3),
    see `limited`. `wanted` (marks, joints, 3): q_d, w_d, tau_ff at every mark of the schedule.
    """

    K_p: float
    K_d: float
    angle: Array
    speed: Array
    torque: Array
    limits: Array
    wanted: Array


@part
def control(law: Law, k: Memory, now: State, mark: int) -> None:
    """Set the torques at a mark."""
    for i in range(len(law.torque)):
        q, w = now.y[law.angle[i]], now.y[law.speed[i]]
        q_d, w_d, ahead = law.wanted[mark, i, 0], law.wanted[mark, i, 1], law.wanted[mark, i, 2]
        tau = law.K_p * (q_d - q) + law.K_d * (w_d - w) + ahead
        k.x[law.torque[i]] = limited(tau, w, law.limits[i])


@part
def limited(tau: float, w: float, limits: Array) -> float:
    """The torque [N.m] that a motor at speed `w` [rad/s] gives when `tau` is asked.

    `limits`: peak torque [N.m], speed without load [rad/s], and the slope [N.m.s] at which torque
    falls with speed.
    """
    peak, noload, slope = float(limits[0]), float(limits[1]), float(limits[2])
    high = min(peak, max(0.0, slope * (noload - w)))
    low = -min(peak, max(0.0, slope * (noload + w)))
    return min(max(tau, low), high)


DONE, FULL, ASK, EXPLODED, BURIED = 0, 1, 2, 3, 4  # why the kernel comes back
DEEP = 5e-3  # m; what starts deeper in the ground or a stop is a mistake
HELD = 1e-4  # s; time over which recorded forces hold the pairs


class Marks(NamedTuple):
    """Marks are the times (m,) [s] at which something is to do.

    `u` (m, nu): inputs that hold from there, NaN for those of the controller; `sent` (m, nu): as
    commanded, which a log shows; `tick` (m,): the controller acts, `asks`: one outside the
    kernel; `row` (m,): the row of the record to fill, or -1.
    """

    time: Array
    u: Array
    sent: Array
    tick: Array
    row: Array
    asks: bool


class NextMark(NamedTuple):
    """The mark to come next, and whether the controller has answered there."""

    mark: Array
    answered: Array


@entry
def play(
    m: KernelModel,
    k: Memory,
    now: State,
    spare: State,
    plan: Marks,
    law: Law,
    pace: Pace,
    log: Impacts,
    table: Array,
    progress: NextMark,
) -> int:
    """Go through the marks and fill `table` (rows, columns); the answer says why it ends.

    A second call continues: after FULL with an emptied log, after ASK with the controller's
    inputs in `k.x`. Raises NoSolutionError.
    """
    for mark in range(progress.mark[0], len(plan.time)):
        progress.mark[0] = mark
        if mark > 0 and not advance(m, k, now, spare, plan.time[mark], pace, log):
            return FULL
        for i in range(m.n, 2 * m.n):
            if not isfinite(now.y[i]):
                return EXPLODED
        if plan.tick[mark] and plan.asks and not progress.answered[0]:
            return ASK
        progress.answered[0] = False
        for i in range(plan.u.shape[1]):
            if not isnan(plan.u[mark, i]):
                k.x[len(now.y) + i] = plan.u[mark, i]
        if plan.tick[mark] and not plan.asks:
            control(law, k, now, mark)
        if mark == 0 and not _start(m, k, now, log):
            return BURIED
        if plan.row[mark] >= 0:
            _record(m, k, now, plan, mark, table)
    return DONE


@part
def _start(m: KernelModel, k: Memory, now: State, log: Impacts) -> bool:
    """What touches at the start stops at once; False where something starts deep in the ground."""
    for i in range(len(now.y)):
        k.x[i] = now.y[i]
    evaluate_pairs(m, k)
    set_gaps(m, k, now)
    for i in range(len(m.gaps)):
        if now.gap[i] < -DEEP:
            return False
    collide(m, k, now, CLOSED, log)
    return True


@part
def _record(m: KernelModel, k: Memory, now: State, plan: Marks, mark: int, table: Array) -> None:
    """A row of the record: state, inputs as sent, forces, outputs, all just after now."""
    size, nu, row = len(now.y), plan.sent.shape[1], plan.row[mark]
    first = len(k.x) - m.n - m.nl
    instant(m, k, now, HELD, touching(m, k, now.gap, CLOSED), first)
    evaluate(m.outputs, k.x, k.y, k.gap)
    for i in range(size):
        table[row, i] = now.y[i]
    for i in range(nu):
        sent = plan.sent[mark, i]
        table[row, size + i] = k.x[size + i] if isnan(sent) else sent
    for i in range(m.nl):
        table[row, size + nu + i] = k.x[first + m.n + i]
    for i in range(len(k.y)):
        table[row, size + nu + m.nl + i] = k.y[i]
