"""Which pairs take part, the forces that hold them, impacts and accelerations at one instant."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from kemba.plant.kernel.jit import kernel, part
from kemba.plant.kernel.lcp import factor, solve, solve_lcp
from kemba.plant.kernel.machine import Array, KernelModel, Memory, State


@intrinsic  # type: ignore[untyped-decorator, unused-ignore]
def _call(typing: Any, address: Any, x: Any, first: Any, second: Any) -> Any:
    """`f(x*, y0*, y1*)` at an address; pointers are integers here."""

    def build(context: Any, builder: Any, _: Any, values: Any) -> Any:
        pointer = ir.DoubleType().as_pointer()
        function = ir.FunctionType(ir.VoidType(), [pointer] * 3).as_pointer()
        places = [builder.inttoptr(value, pointer) for value in values[1:]]
        builder.call(builder.inttoptr(values[0], function), places)
        return context.get_dummy_value()

    return types.void(types.intp, types.intp, types.intp, types.intp), build


@kernel
def evaluate(address: int, x: Array, first: Array, second: Array) -> None:
    """Call machine code at `address`: from x (k,) it fills the arrays `first` and `second`."""
    _call(address, x.ctypes.data, first.ctypes.data, second.ctypes.data)


COMPLIANT = 1e-3  # m; compliant gaps this close take part, whether they push or not


@kernel
def touching(m: KernelModel, k: Memory, gap: Array, reach: float) -> int:
    """How many pairs take part; their rows are the first of `k.rows`: gaps within `reach` [m]
    (compliant ones within `COMPLIANT`) with the friction that belongs to them."""
    count = 0
    for row in range(m.nl):
        part, is_gap = m.ungapped[row], False
        for i in range(len(m.gaps)):
            near = gap[i] <= (reach if m.rigid[i] else COMPLIANT)
            if m.gaps[i] == row:
                part, is_gap = near, True
            elif near and not is_gap and m.group[m.gaps[i]] == m.group[row]:
                part = True
        if part:
            k.rows[count] = row
            count += 1
    return count


@kernel
def evaluate_pairs(m: KernelModel, k: Memory) -> None:
    """The pairs at the state in `k.x`; compliant gaps push as remembered."""
    evaluate(m.pairs, k.x, k.pairs, k.gap)
    for i in range(len(m.gaps)):
        if m.rigid[i]:
            k.pairs[m.gaps[i], m.n + m.nl] = 0.0  # which others add to, and machine code leaves
        else:
            for j in range(m.n, m.n + m.nl + 1):
                k.pairs[m.gaps[i], j] = k.before[m.gaps[i], j]


@kernel
def remember_push(m: KernelModel, k: Memory) -> None:
    """Remember how compliant gaps push at the state in `k.x`: their force is smooth, and acts as
    at the beginning of a stage."""
    for i in range(len(m.gaps)):
        if not m.rigid[i]:
            evaluate(m.pairs, k.x, k.before, k.gap)
            return


@kernel
def add_forces(
    m: KernelModel, k: Memory, count: int, T: Array, share: float, v: Array, moves: bool
) -> None:
    """The forces `k.lcp.z` that hold the first `count` of `k.rows` where velocities are
    v + share T lam; v becomes that.

    T (n, 1 + nl) has a column per row behind its first. Without `moves` only the part of the
    pairs that is linear in velocity counts, as in an impact.
    """
    w, last = k.lcp, m.n + m.nl
    for i in range(count):
        row = k.rows[i]
        w.on[i] = k.held[row]
        w.b[i] = k.pairs[row, last] if moves else 0.0
        for c in range(m.n):
            w.b[i] += k.pairs[row, c] * v[c]
        for j in range(count):
            w.A[i, j] = k.pairs[row, m.n + k.rows[j]]
            for c in range(m.n):
                w.A[i, j] += k.pairs[row, c] * (share * T[c, 1 + j])
    solve_lcp(w, count)
    for i in range(count):
        k.held[k.rows[i]] = w.on[i]
        for c in range(m.n):
            v[c] += share * T[c, 1 + i] * w.z[i]


@kernel
def set_gaps(m: KernelModel, k: Memory, at: State) -> None:
    """Gaps of a state and their rates, from the pairs just evaluated there."""
    for i in range(len(m.gaps)):
        at.gap[i] = k.gap[i]
        at.rate[i] = 0.0
        for c in range(m.n):
            at.rate[i] += k.pairs[m.gaps[i], c] * at.y[m.n + c]


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
