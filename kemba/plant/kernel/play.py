"""A whole simulation: from mark to mark, inputs, impacts and record."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from kemba.plant.kernel.calls import evaluate
from kemba.plant.kernel.control import Law, control
from kemba.plant.kernel.events import CLOSED, Impacts, advance, collide
from kemba.plant.kernel.forces import touching
from kemba.plant.kernel.impact import instant, place, slip_speeds
from kemba.plant.kernel.jit import kernel
from kemba.plant.kernel.machine import Machine, Memory, State
from kemba.plant.stepping.arrays import Array

DONE, FULL, ASK, EXPLODED, BURIED = 0, 1, 2, 3, 4  # why the kernel comes back
DEEP = 5e-3  # m; what starts deeper in the ground or a stop is a mistake


class Schedule(NamedTuple):
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


class Progress(NamedTuple):
    """The mark to come next, and whether the controller has answered there."""

    mark: Array
    answered: Array


@kernel
def play(
    m: Machine,
    k: Memory,
    now: State,
    spare: State,
    plan: Schedule,
    law: Law,
    longest: float,
    log: Impacts,
    table: Array,
    progress: Progress,
) -> int:
    """Go through the marks and fill `table`; the answer says why it ends.

    Called again it goes on: after FULL with an emptied log, after ASK with the controller's
    inputs in `k.x`. Raises NoSolutionError.
    """
    for mark in range(progress.mark[0], len(plan.time)):
        progress.mark[0] = mark
        if mark > 0 and not advance(m, k, now, spare, plan.time[mark], longest, log):
            return FULL
        for i in range(m.n, 2 * m.n):
            if not np.isfinite(now.y[i]):
                return EXPLODED
        if plan.tick[mark] and plan.asks and not progress.answered[0]:
            return ASK
        progress.answered[0] = False
        _inputs(m, k, plan, mark)
        if plan.tick[mark] and not plan.asks:
            control(law, k, now, mark)
        if mark == 0:
            place(m, k, now)
            if (now.gap < -DEEP).any():
                return BURIED
            collide(m, k, now, CLOSED, log)
        if plan.row[mark] >= 0:
            _record(m, k, now, longest, plan.sent[mark], table[plan.row[mark]])
    return DONE


@kernel
def _inputs(m: Machine, k: Memory, plan: Schedule, mark: int) -> None:
    for i in range(plan.u.shape[1]):
        if not np.isnan(plan.u[mark, i]):
            k.x[2 * m.n + m.ns + i] = plan.u[mark, i]


@kernel
def _record(m: Machine, k: Memory, now: State, h: float, sent: Array, row: Array) -> None:
    """A row of the record: state, inputs as sent, forces, outputs, all just after now."""
    size, nu = len(now.y), len(sent)
    a, lam = k.x[len(k.x) - m.n - m.nl : len(k.x) - m.nl], k.x[len(k.x) - m.nl :]
    rows = touching(m, now.gap, CLOSED)
    instant(m, k, now, rows, h, a, lam)
    slip_speeds(m, k, now, rows, lam)
    k.x[:size] = now.y
    evaluate(m.outputs, k.x, k.y, k.gap)
    row[:size] = now.y
    for i in range(nu):
        row[size + i] = k.x[size + i] if np.isnan(sent[i]) else sent[i]
    row[size + nu : size + nu + m.nl] = lam
    row[size + nu + m.nl :] = k.y
