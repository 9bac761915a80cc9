"""What holds at one instant: impacts, accelerations, forces."""

from __future__ import annotations

import numpy as np

from kemba.plant.kernel.calls import evaluate
from kemba.plant.kernel.forces import (
    add,
    contact_forces,
    evaluate_pairs,
    keep_soft,
    set_gaps,
    use_soft,
)
from kemba.plant.kernel.jit import kernel
from kemba.plant.kernel.linear import factor, solve
from kemba.plant.kernel.machine import Machine, Memory, State
from kemba.plant.stepping.arrays import Array


@kernel
def place(m: Machine, k: Memory, now: State) -> None:
    """Set the gaps of a state whose `y` is given."""
    k.x[: len(now.y)] = now.y
    evaluate_pairs(m, k)
    set_gaps(m, k, now)


@kernel
def impact(m: Machine, k: Memory, now: State, rows: Array, impulse: Array) -> float:
    """An inelastic impact at the pairs `rows` changes the state `now`.

    Fills the impulses (nl,) [N.s] and gives the kinetic energy lost [J]. Energy cannot grow: the
    impulses work against the velocity after them.
    """
    n, v = m.n, now.y[m.n : 2 * m.n]
    _accelerations(m, k, now, rows)
    evaluate_pairs(m, k)
    found = contact_forces(m, k, rows, k.X, 1.0, v, False)
    old = v.copy()
    add(v, k.X, 1.0, found)
    impulse[:] = 0.0
    for j in range(len(rows)):
        impulse[rows[j]] = found[j]
    lost = 0.0
    for i in range(n):
        for j in range(n):
            lost += 0.5 * (old[i] - v[i]) * k.full[i, n + j] * (old[j] + v[j])
    set_gaps(m, k, now)
    return lost


@kernel
def instant(m: Machine, k: Memory, now: State, rows: Array, h: float, a: Array, lam: Array) -> None:
    """Fills accelerations (n,) and forces (nl,) [N] just after `now`.

    The forces are those that hold the pairs over a short `h` [s].
    """
    n = m.n
    q, v = now.y[:n], now.y[n : 2 * n]
    _accelerations(m, k, now, rows)
    keep_soft(m, k)
    lam[:] = 0.0
    if len(rows):
        for i in range(n):
            k.x[i] = q[i] + h * v[i]
        evaluate_pairs(m, k)
        use_soft(m, k)
        for i in range(len(m.gaps)):  # touching at rest, not hitting
            k.pairs[m.gaps[i], n + m.nl] -= min(now.rate[i], 0.0)
        ahead = np.empty(n)
        for i in range(n):
            ahead[i] = v[i] + h * k.X[i, 0]
        found = contact_forces(m, k, rows, k.X, h, ahead, True)
        add(k.X[:, 0], k.X, 1.0, found)
        for j in range(len(rows)):
            lam[rows[j]] = found[j]
    a[:] = k.X[:, 0]


@kernel
def slip_speeds(m: Machine, k: Memory, now: State, rows: Array, lam: Array) -> None:
    """Slip speeds of open feet: the least that keeps their pairs true."""
    n, v = m.n, now.y[m.n : 2 * m.n]
    taking_part = np.zeros(m.nl, dtype=np.bool_)
    taking_part[rows] = True
    k.x[: len(now.y)] = now.y
    evaluate_pairs(m, k)
    for speed in range(m.nl):
        if m.slips[speed].any() and not taking_part[speed]:
            lam[speed] = 0.0
            for row in range(m.nl):
                if m.slips[speed, row]:
                    rate = 0.0
                    for c in range(n):
                        rate += k.pairs[row, c] * v[c]
                    lam[speed] = max(lam[speed], abs(rate))


@kernel
def _accelerations(m: Machine, k: Memory, now: State, rows: Array) -> None:
    """X (n, 1 + len(rows)): acceleration without forces, and per force of the pairs `rows`."""
    n = m.n
    k.x[: len(now.y)] = now.y
    evaluate(m.smooth, k.x, k.smooth, k.later)
    for i in range(n):
        k.X[i, 0] = k.smooth[i, 2 * n]
        for j in range(n):
            k.full[i, n + j] = k.smooth[i, n + j]
            k.inertia[i, j] = k.smooth[i, n + j]
        for j in range(len(rows)):
            k.X[i, 1 + j] = k.smooth[i, 2 * n + 1 + rows[j]]
    factor(k.inertia)
    solve(k.inertia, k.X, 1 + len(rows))
