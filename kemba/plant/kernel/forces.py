"""Which pairs take part, and the forces that hold them."""

from __future__ import annotations

import numpy as np

from kemba.plant.kernel.calls import evaluate
from kemba.plant.kernel.jit import kernel
from kemba.plant.kernel.lcp import solve_lcp
from kemba.plant.kernel.machine import Machine, Memory, State
from kemba.plant.stepping.arrays import Array

SOFT_REACH = 1e-3  # m; compliant gaps this close take part, whether they push or not


@kernel
def touching(m: Machine, gap: Array, reach: float) -> Array:
    """Rows of the pair table that take part: gaps within `reach` [m] (compliant ones within
    `SOFT_REACH`) with the friction that belongs to them."""
    part = m.ungapped.copy()
    for i in range(len(m.gaps)):
        if gap[i] <= (reach if m.rigid[i] else SOFT_REACH):
            for row in range(m.nl):
                part[row] |= m.group[row] == m.group[m.gaps[i]]
    for i in range(len(m.gaps)):
        part[m.gaps[i]] = gap[i] <= (reach if m.rigid[i] else SOFT_REACH)
    return np.flatnonzero(part)


@kernel
def evaluate_pairs(m: Machine, k: Memory) -> None:
    """The pairs at the state in `k.x`."""
    evaluate(m.pairs, k.x, k.pairs, k.gap)


@kernel
def keep_soft(m: Machine, k: Memory) -> None:
    """Remember how compliant gaps push at the state in `k.x`: their force is smooth."""
    if not m.rigid.all():
        evaluate(m.pairs, k.x, k.before, k.gap)


@kernel
def use_soft(m: Machine, k: Memory) -> None:
    """Put the remembered push of compliant gaps into the pairs."""
    for i in range(len(m.gaps)):
        if not m.rigid[i]:
            for j in range(m.n, m.n + m.nl + 1):
                k.pairs[m.gaps[i], j] = k.before[m.gaps[i], j]


@kernel
def contact_forces(
    m: Machine, k: Memory, rows: Array, T: Array, share: float, v: Array, moves: bool
) -> Array:
    """Forces lam (len(rows),) that hold the pairs `rows` where velocities are v + share T lam.

    T (n, 1 + len(rows)) has a column per row behind its first. Without `moves` only the part of
    the pairs that is linear in velocity counts, as in an impact.
    """
    size, last = len(rows), m.n + m.nl
    A, b = np.empty((size, size)), np.empty(size)
    guess = np.empty(size, dtype=np.bool_)
    for i in range(size):
        W = k.pairs[rows[i]]
        guess[i] = k.held[rows[i]]
        b[i] = W[last] if moves else 0.0
        for c in range(m.n):
            b[i] += W[c] * v[c]
        for j in range(size):
            A[i, j] = W[m.n + rows[j]]
            for c in range(m.n):
                A[i, j] += W[c] * (share * T[c, 1 + j])
    lam, active = solve_lcp(A, b, guess)
    for i in range(size):
        k.held[rows[i]] = active[i]
    return lam


@kernel
def add(v: Array, T: Array, share: float, lam: Array) -> None:
    """v += share T lam, with T as in `contact_forces`."""
    for i in range(len(v)):
        for j in range(len(lam)):
            v[i] += share * T[i, 1 + j] * lam[j]


@kernel
def set_gaps(m: Machine, k: Memory, at: State) -> None:
    """Gaps of a state and their rates, from the pairs just evaluated there."""
    v = at.y[m.n :]
    for i in range(len(m.gaps)):
        at.gap[i] = k.gap[i]
        at.rate[i] = 0.0
        for c in range(m.n):
            at.rate[i] += k.pairs[m.gaps[i], c] * v[c]
