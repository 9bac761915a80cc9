"""One step between events: linearly implicit, second order, with contact; and its length.

ROS2 as a W-method (Verwer, Spee, Blom, Hundsdorfer, SIAM J. Sci. Comput. 20, 1999): second order
for any approximate Jacobian, L-stable for an exact one. Only the stiff blocks enter it, damping
D = dF/dv and the effect states' own A = df/ds; positions then follow by the trapezoidal rule.

    (M - g h D) k1 = F + B lam1                        v1 = v + h k1
    (M - g h D) k2 = M (M1^-1 (F1 + B1 lam2) - 2 k1)   v2 = v + h (3 k1 + k2) / 2

Closed contacts are held at velocity level at the end of both stages, as half-explicit Runge-Kutta
methods do for index 2; lam1 and lam2 solve small complementarity problems w = A lam + b.
"""

from math import sqrt
from typing import NamedTuple

from kemba.plant.kernel.contact import add_forces, evaluate, evaluate_pairs, remember_push, set_gaps
from kemba.plant.kernel.jit import kernel, part
from kemba.plant.kernel.lcp import factor, solve
from kemba.plant.kernel.machine import GAMMA, Array, KernelModel, Memory, State

PULL_BACK = 0.2  # share of the drift that one step removes
SHORTEST = 1e-5  # s; shorter steps remove no more (rounding would become speed)
FASTEST = 0.05  # m.s-1; largest speed of a foot that starts below the ground


@kernel
def step(m: KernelModel, k: Memory, now: State, h: float, count: int, new: State) -> float:
    """One step of `h` [s] from `now` to `new`; the first `count` of the pairs `k.rows` stay closed.

    Gives how far `new` is from the result of the first stage, which is of first order: the largest
    difference of a velocity or an effect state, divided by its usual size.
    """
    n, apart = m.n, 0.0
    for i in range(len(now.y)):
        k.x[i] = now.y[i]
    _first_stage(m, k, now, h, count)
    _second_stage(m, k, now, h, count)
    for i in range(n):
        new.y[i] = now.y[i] + h * (now.y[n + i] + k.v[i]) / 2.0
        k.v[i] = now.y[n + i] + h * (3.0 * k.X[i, 0] + k.Y[i, 0]) / 2.0
    for i in range(m.ns):
        new.y[2 * n + i] = now.y[2 * n + i] + h * (3.0 * k.k1[i, 0] + k.k2[i, 0]) / 2.0
        apart = max(apart, abs(new.y[2 * n + i] - k.x[2 * n + i]) / m.scale[n + i])
        k.x[2 * n + i] = new.y[2 * n + i]
    for i in range(n):
        k.x[i] = new.y[i]
    evaluate_pairs(m, k)
    if count > 0:
        _pull_back(m, k, h)
        add_forces(m, k, count, k.Y, h / 2.0, k.v, True)
    for i in range(n):
        new.y[n + i] = k.v[i]
        apart = max(apart, abs(k.v[i] - k.x[n + i]) / m.scale[i])
    set_gaps(m, k, new)
    new.time[0] = now.time[0] + h
    return apart


@part
def _first_stage(m: KernelModel, k: Memory, now: State, h: float, count: int) -> None:
    """k1 into X[:, 0] and `k.k1`; `k.x` becomes the state (q1, v1, s1) behind it, v1 = `k.v`."""
    n, ns = m.n, m.ns
    remember_push(m, k)
    evaluate(m.full, k.x, k.full, k.air)
    for i in range(n):
        k.X[i, 0] = k.full[i, 2 * n]
        for j in range(count):
            k.X[i, 1 + j] = k.full[i, 2 * n + 1 + k.rows[j]]
        for j in range(n):
            k.left[i, j] = k.full[i, n + j] - GAMMA * h * k.full[i, j]
    factor(k.left)
    solve(k.left, k.X, 1 + count)
    for i in range(n):
        k.x[i] = now.y[i] + h * now.y[n + i]
        k.v[i] = now.y[n + i] + h * k.X[i, 0]
    if count > 0:
        evaluate_pairs(m, k)
        add_forces(m, k, count, k.X, h, k.v, True)
        for i in range(n):
            for j in range(count):
                k.X[i, 0] += k.X[i, 1 + j] * k.lcp.z[j]
    for i in range(n):
        k.x[n + i] = k.v[i]
    for i in range(ns):
        k.k1[i, 0] = k.air[i, ns]
        for j in range(ns):
            k.air_left[i, j] = (1.0 if i == j else 0.0) - GAMMA * h * k.air[i, j]
    factor(k.air_left)
    solve(k.air_left, k.k1, 1)
    for i in range(ns):
        k.x[2 * n + i] += h * k.k1[i, 0]


@part
def _second_stage(m: KernelModel, k: Memory, now: State, h: float, count: int) -> None:
    """k2 into Y[:, 0] and `k.k2`, acceleration per force into the other columns of Y."""
    n, ns = m.n, m.ns
    remember_push(m, k)
    evaluate(m.smooth, k.x, k.smooth, k.later)
    for i in range(n):
        k.Y[i, 0] = k.smooth[i, 2 * n]
        for j in range(count):
            k.Y[i, 1 + j] = k.smooth[i, 2 * n + 1 + k.rows[j]]
        for j in range(n):
            k.inertia[i, j] = k.smooth[i, n + j]
    factor(k.inertia)
    solve(k.inertia, k.Y, 1 + count)
    for i in range(n):
        k.Y[i, 0] -= 2.0 * k.X[i, 0]
    for c in range(1 + count):
        for i in range(n):
            k.old[i] = k.Y[i, c]
        for i in range(n):
            k.Y[i, c] = 0.0
            for j in range(n):
                k.Y[i, c] += k.full[i, n + j] * k.old[j]
    solve(k.left, k.Y, 1 + count)
    for i in range(ns):
        k.k2[i, 0] = k.later[i, ns] - 2.0 * k.k1[i, 0]
    solve(k.air_left, k.k2, 1)


@part
def _pull_back(m: KernelModel, k: Memory, h: float) -> None:
    """Closed gaps that have drifted return to zero; those that are too deep return slowly."""
    for i in range(len(m.gaps)):
        if m.rigid[i]:
            drift = PULL_BACK * k.gap[i] / max(h, SHORTEST)
            k.pairs[m.gaps[i], m.n + m.nl] += max(drift, -FASTEST)


GROWTH = 2.0  # largest growth from one step to the next
SHRINKING = 0.3  # smallest share of the last step
# share of the length at which the tolerance is just met (literature: Hairer, Norsett and Wanner
# 1993, II.4: 0.8 to 0.9)
SAFETY = 0.9


class Pace(NamedTuple):
    """`step` (1,) is the present length, from `shortest` to `longest` [s].

    Of a step the result of the first stage, first order, may differ from that of both by
    `tolerance`, see `step`; infinite for steps of equal length.
    """

    step: Array
    shortest: float
    longest: float
    tolerance: float


@part
def keeps_pace(pace: Pace, h: float, apart: float) -> bool:
    """Whether a step of `h` [s] was short enough; sets the length of the next one.

    `apart`: how far the results of its stages differ. It grows with the square of the length.
    """
    if apart < 1e-9 * pace.tolerance:
        factor = GROWTH
    else:
        factor = min(GROWTH, max(SHRINKING, SAFETY * sqrt(pace.tolerance / apart)))
    again = apart > pace.tolerance and h > 1.001 * pace.shortest
    wanted = h * factor
    if not again and h < SAFETY * pace.step[0]:  # cut by an event or a mark
        wanted = max(wanted, pace.step[0])
    pace.step[0] = min(pace.longest, max(pace.shortest, wanted))
    return not again
