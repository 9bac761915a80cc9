"""One step between events: linearly implicit, second order, with contact.

ROS2 as a W-method (Verwer, Spee, Blom, Hundsdorfer, SIAM J. Sci. Comput. 20, 1999): second order
for any approximate Jacobian, L-stable for an exact one. Only the stiff blocks enter it, damping
D = dF/dv and the effect states' own A = df/ds; positions then follow by the trapezoidal rule.

    (M - g h D) k1 = F + B lam1                        v1 = v + h k1
    (M - g h D) k2 = M (M1^-1 (F1 + B1 lam2) - 2 k1)   v2 = v + h (3 k1 + k2) / 2

Closed contacts are held at velocity level at the end of both stages, as half-explicit Runge-Kutta
methods do for index 2; lam1 and lam2 solve small complementarity problems w = A lam + b.
"""

from __future__ import annotations

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
from kemba.plant.kernel.scheme import FASTEST, GAMMA, PULL_BACK, SHORTEST
from kemba.plant.stepping.arrays import Array


@kernel
def step(m: Machine, k: Memory, now: State, h: float, rows: Array, new: State) -> None:
    """`new` is the state after `h` [s] with the pairs `rows` held and the others left alone."""
    n, ns, columns = m.n, m.ns, 1 + len(rows)
    q, v = now.y[:n], now.y[n : 2 * n]
    q1, v1, s1 = k.x[:n], k.x[n : 2 * n], k.x[2 * n : 2 * n + ns]
    q2, v2, s2 = new.y[:n], new.y[n : 2 * n], new.y[2 * n :]
    _load(k, now)
    keep_soft(m, k)
    evaluate(m.full, k.x, k.full, k.air)
    for i in range(n):
        for j in range(n):
            k.left[i, j] = k.full[i, n + j] - GAMMA * h * k.full[i, j]
    factor(k.left)
    _columns(k.full, rows, k.X)
    solve(k.left, k.X, columns)

    # first stage: k1 in X[:, 0], after which x holds the state in the middle
    for i in range(n):
        q1[i] = q[i] + h * v[i]
    if columns > 1:
        evaluate_pairs(m, k)
        use_soft(m, k)
        for i in range(n):
            v2[i] = v[i] + h * k.X[i, 0]
        lam = contact_forces(m, k, rows, k.X, h, v2, True)
        add(k.X[:, 0], k.X, 1.0, lam)
    for i in range(n):
        v1[i] = v[i] + h * k.X[i, 0]
    _first_air(k, h)
    for i in range(ns):
        s1[i] += h * k.k1[i, 0]
    keep_soft(m, k)
    evaluate(m.smooth, k.x, k.smooth, k.later)

    # second stage: k2 in Y[:, 0]
    for i in range(n):
        for j in range(n):
            k.inertia[i, j] = k.smooth[i, n + j]
    factor(k.inertia)
    _columns(k.smooth, rows, k.Y)
    solve(k.inertia, k.Y, columns)
    for i in range(n):
        k.Y[i, 0] -= 2.0 * k.X[i, 0]
    _times_inertia(k, columns)
    solve(k.left, k.Y, columns)
    for i in range(ns):
        k.k2[i, 0] = k.later[i, ns] - 2.0 * k.k1[i, 0]
    solve(k.air_left, k.k2, 1)
    for i in range(n):
        q2[i] = q[i] + h * (v[i] + v1[i]) / 2.0
        v2[i] = v[i] + h * (3.0 * k.X[i, 0] + k.Y[i, 0]) / 2.0
        q1[i] = q2[i]
    for i in range(ns):
        s2[i] = now.y[2 * n + i] + h * (3.0 * k.k1[i, 0] + k.k2[i, 0]) / 2.0
        s1[i] = s2[i]
    evaluate_pairs(m, k)
    if columns > 1:
        use_soft(m, k)
        _pull_back(m, k, h)
        add(v2, k.Y, h / 2.0, contact_forces(m, k, rows, k.Y, h / 2.0, v2, True))
    set_gaps(m, k, new)
    new.time[0] = now.time[0] + h


@kernel
def _load(k: Memory, now: State) -> None:
    for i in range(len(now.y)):
        k.x[i] = now.y[i]


@kernel
def _columns(source: Array, rows: Array, X: Array) -> None:
    """F and the columns of B that belong to the forces `rows`."""
    n = len(source)
    for i in range(n):
        X[i, 0] = source[i, 2 * n]
        for j in range(len(rows)):
            X[i, 1 + j] = source[i, 2 * n + 1 + rows[j]]


@kernel
def _first_air(k: Memory, h: float) -> None:
    """The first stage of the effect states, k1, and the factors of their implicit matrix."""
    ns = len(k.air)
    for i in range(ns):
        for j in range(ns):
            k.air_left[i, j] = -GAMMA * h * k.air[i, j]
        k.air_left[i, i] += 1.0
        k.k1[i, 0] = k.air[i, ns]
    factor(k.air_left)
    solve(k.air_left, k.k1, 1)


@kernel
def _times_inertia(k: Memory, columns: int) -> None:
    """Y becomes M Y, with the inertia of the first stage."""
    n, product = len(k.full), k.inertia[0]
    for c in range(columns):
        for i in range(n):
            product[i] = 0.0
            for j in range(n):
                product[i] += k.full[i, n + j] * k.Y[j, c]
        for i in range(n):
            k.Y[i, c] = product[i]


@kernel
def _pull_back(m: Machine, k: Memory, h: float) -> None:
    """Let held rigid gaps that have drifted return, and the quickly closing ones not too fast."""
    last = m.n + m.nl
    for i in range(len(m.gaps)):
        if m.rigid[i]:
            drift = PULL_BACK * k.gap[i] / max(h, SHORTEST)
            k.pairs[m.gaps[i], last] += max(drift, -FASTEST)
