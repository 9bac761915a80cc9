"""Which pairs take part, and the forces that hold them."""

from __future__ import annotations

from kemba.plant.kernel.algebra.lcp import solve_lcp
from kemba.plant.kernel.calls import evaluate
from kemba.plant.kernel.jit import kernel
from kemba.plant.kernel.machine import KernelModel, Memory, State
from kemba.plant.kernel.settings import ContactEvents
from kemba.plant.stepping.arrays import Array

COMPLIANT = ContactEvents.current().compliant


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
