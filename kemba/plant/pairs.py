"""Complementarity pairs of a model, as the plant holds them.

Every pair has one side that is a force symbol of its own (z) and an expression on the other (w).
Where w without forces depends on coordinates only it is a gap: rigid, held at velocity level, or
compliant, with a force that follows from its depth. Otherwise it is already a relation between
velocities and forces, such as a friction cone.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from kemba.errors import KembaError
from kemba.plant.kernel.machine import Array


@dataclass(frozen=True)
class PairTable:
    """Pairs ordered by their force: row i is the pair of lam[i].

    `gap` (ng, 1) holds the expressions of the position pairs and `gaps` their rows; `group`
    numbers the effect instance of each row. w = W v + L lam + w0, where a rigid gap has its
    Jacobian in W and w0 = 0, and a compliant one, which yields with its force, W = 0 and w0 the
    gap itself. `free_speeds`: rows of slip speeds, with the rows of slip they bound; an open
    contact leaves them undetermined.
    """

    labels: tuple[str, ...]
    gap: ca.SX
    gaps: Array
    rigid: Array  # (ng,) whether each gap is rigid
    group: Array
    W: ca.SX
    L: ca.SX
    w0: ca.SX
    free_speeds: tuple[tuple[int, Array], ...] = ()

    @cached_property
    def ungapped(self) -> Array:
        """Whether each row belongs to an instance without gaps, which cannot open."""
        return ~np.isin(self.group, self.group[self.gaps])


def read_pairs(node: Any) -> PairTable:
    """The pair table of a node. Raises KembaError where a pair has no force of its own."""
    size = node.lam.numel()
    rows: dict[int, tuple[str, ca.SX]] = {}
    for i in range(node.pair_a.numel()):
        label = node.pair_rows[i][0].label
        index, other = _split(node, node.pair_a[i], node.pair_b[i], rows, label)
        rows[index] = (label, other)
    for i in range(size):
        if i not in rows:
            raise KembaError(str(node.lam[i]), "no complementarity pair determines this force")
    return _table(node, [rows[i] for i in range(size)])


def _split(node: Any, a: ca.SX, b: ca.SX, taken: dict[int, Any], label: str) -> tuple[int, ca.SX]:
    for side, other in ((b, a), (a, b)):
        for j in range(node.lam.numel()):
            if j not in taken and ca.is_equal(side, node.lam[j]):
                return j, other
    raise KembaError(label, "neither side of this pair is a force of its own")


def _table(node: Any, rows: list[tuple[str, ca.SX]]) -> PairTable:
    labels = tuple(label for label, _ in rows)
    w = ca.SX(ca.vertcat(*(other for _, other in rows)))
    L = ca.jacobian(w, node.lam)
    if rows and _depends(L, ca.vertcat(node.lam, node.a)):
        raise KembaError(labels[0], "the pairs are not linear in the forces")
    base = ca.substitute([w], [node.lam], [ca.SX.zeros(node.lam.numel())])[0]
    moving = ca.vertcat(node.v, node.s, node.u)
    gaps = [
        i for i in range(len(rows)) if _depends(base[i], node.q) and not _depends(base[i], moving)
    ]
    rigid = [L[i, :].nnz() == 0 for i in gaps]
    W, w0 = ca.jacobian(base, node.v), base - ca.jtimes(base, node.v, node.v)
    for i, firm in zip(gaps, rigid, strict=True):
        if firm:
            W[i, :], w0[i] = ca.jacobian(base[i], node.q), 0
    gap = ca.SX(ca.vertcat(*(base[i] for i in gaps))) if gaps else ca.SX.zeros(0, 1)
    instances = [label.rsplit(":", 1)[0] for label in labels]
    order = list(dict.fromkeys(instances))
    group = np.array([order.index(name) for name in instances], dtype=int)
    index, hard = np.array(gaps, dtype=int), np.array(rigid, dtype=bool)
    slips = _free_speeds(W, L, gaps, group)
    return PairTable(labels, gap, index, hard, group, W, L, w0, slips)


def _free_speeds(
    W: ca.SX, L: ca.SX, gaps: list[int], group: Array
) -> tuple[tuple[int, Array], ...]:
    """Forces that enter relations between velocities with weight 1, such as slip speeds."""
    found = []
    for column in range(len(group)):
        rows = [i for i in range(len(group)) if W[i, :].nnz() and L[i, column].is_one()]
        if rows and group[rows[0]] in group[gaps]:
            found.append((column, np.array(rows)))
    return tuple(found)


def _depends(expression: ca.SX, symbols: ca.SX) -> bool:
    return any(ca.which_depends(ca.vec(expression), symbols, 1, True))
