"""What holds at one instant: impacts, accelerations, forces."""

from __future__ import annotations

from kemba.plant.kernel.algebra.linear import factor, solve
from kemba.plant.kernel.calls import evaluate
from kemba.plant.kernel.forces import add_forces, evaluate_pairs, remember_push, set_gaps
from kemba.plant.kernel.jit import kernel, part
from kemba.plant.kernel.machine import KernelModel, Memory, State


@part
def impact(m: KernelModel, k: Memory, now: State, count: int) -> float:
    """An inelastic impact at the first `count` of the pairs `k.rows` changes the state `now`.

    Impulses are in `k.lcp.z` [N.s]; gives the kinetic energy lost [J]. Energy cannot grow: the
    impulses work against the velocity after them.
    """
    n, lost = m.n, 0.0
    _accelerations(m, k, now, count)
    evaluate_pairs(m, k)
    for i in range(n):
        k.old[i] = k.v[i] = now.y[n + i]
    add_forces(m, k, count, k.X, 1.0, k.v, False)
    for i in range(n):
        now.y[n + i] = k.v[i]
        for j in range(n):
            lost += 0.5 * (k.old[i] - k.v[i]) * k.smooth[i, n + j] * (k.old[j] + k.v[j])
    set_gaps(m, k, now)
    return lost


@part
def instant(m: KernelModel, k: Memory, now: State, h: float, count: int, first: int) -> None:
    """Accelerations (n,) and forces (nl,) [N] just after `now`, into `k.x` from `first` on.

    The forces are those that hold the first `count` of the pairs `k.rows` over a short `h` [s];
    slip speeds of open feet are the least that keep their pairs true.
    """
    n, lam = m.n, first + m.n
    for row in range(m.nl):
        k.x[lam + row] = 0.0
    _accelerations(m, k, now, count)
    remember_push(m, k)
    evaluate_pairs(m, k)
    for speed in range(m.nl):
        for row in range(m.nl):
            if m.slips[speed, row]:
                rate = 0.0
                for c in range(n):
                    rate += k.pairs[row, c] * now.y[n + c]
                k.x[lam + speed] = max(k.x[lam + speed], abs(rate))
    for i in range(n):
        k.x[i] = now.y[i] + h * now.y[n + i]
        k.v[i] = now.y[n + i] + h * k.X[i, 0]
    if count > 0:
        evaluate_pairs(m, k)
        for i in range(len(m.gaps)):  # touching at rest, not hitting
            k.pairs[m.gaps[i], n + m.nl] -= min(now.rate[i], 0.0)
        add_forces(m, k, count, k.X, h, k.v, True)
    for j in range(count):
        k.x[lam + k.rows[j]] = k.lcp.z[j]
    for i in range(n):
        k.x[first + i] = k.X[i, 0]
        for j in range(count):
            k.x[first + i] += k.X[i, 1 + j] * k.lcp.z[j]
    for i in range(n):
        k.x[i] = now.y[i]


@kernel
def _accelerations(m: KernelModel, k: Memory, now: State, count: int) -> None:
    """X (n, 1 + nl): acceleration without forces, and per force of the pairs in `k.rows`."""
    n = m.n
    for i in range(len(now.y)):
        k.x[i] = now.y[i]
    evaluate(m.smooth, k.x, k.smooth, k.later)
    for i in range(n):
        k.X[i, 0] = k.smooth[i, 2 * n]
        for j in range(n):
            k.inertia[i, j] = k.smooth[i, n + j]
        for j in range(count):
            k.X[i, 1 + j] = k.smooth[i, 2 * n + 1 + k.rows[j]]
    factor(k.inertia)
    solve(k.inertia, k.X, 1 + count)
