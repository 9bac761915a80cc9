"""Complementarity pairs as the plant steps them: one force each, gaps told from rates.

Every pair has one side that is a force symbol of its own (z) and an expression on the other (w).
Where w depends on coordinates only it is a gap, held at velocity level; otherwise it is already a
relation between velocities and forces, such as a friction cone.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from kemba.errors import KembaError
from kemba.trajectory import Array


@dataclass(frozen=True)
class PairTable:
    """Pairs ordered by their force: row i is the pair of lam[i].

    `gap` (ng, 1) holds the expressions of the position pairs and `gaps` their rows; `group`
    numbers the effect instance of each row. w = W v + L lam + w0, for a gap with W its Jacobian
    and w0 = 0. `free_speeds`: rows of slip speeds, with the rows of slip they bound; an open
    contact leaves them undetermined.
    """

    labels: tuple[str, ...]
    gap: ca.SX
    gaps: Array
    group: Array
    W: ca.SX
    L: ca.SX
    w0: ca.SX
    free_speeds: tuple[tuple[int, Array], ...] = ()

    @cached_property
    def is_gap(self) -> Array:
        """Whether each row is a position pair."""
        return np.isin(np.arange(len(self.labels)), self.gaps)

    @cached_property
    def always_mask(self) -> Array:
        """Whether each row belongs to an instance without gaps, which cannot open."""
        return ~np.isin(self.group, self.group[self.gaps])

    @cached_property
    def always(self) -> Array:
        """The rows that always take part."""
        return np.flatnonzero(self.always_mask)


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


def _split(
    node: Any, a: ca.SX, b: ca.SX, taken: dict[int, Any], label: str
) -> tuple[int, ca.SX]:
    for side, other in ((b, a), (a, b)):
        for j in range(node.lam.numel()):
            if j not in taken and ca.is_equal(side, node.lam[j]):
                return j, other
    raise KembaError(label, "neither side of this pair is a force of its own")


def _table(node: Any, rows: list[tuple[str, ca.SX]]) -> PairTable:
    labels = tuple(label for label, _ in rows)
    w = ca.SX(ca.vertcat(*(other for _, other in rows)))
    moving = ca.vertcat(node.v, node.lam, node.s, node.u)
    gaps = [i for i in range(len(rows)) if not _depends(w[i], moving)]
    instances = [label.rsplit(":", 1)[0] for label in labels]
    order = list(dict.fromkeys(instances))
    W, L = ca.jacobian(w, node.v), ca.jacobian(w, node.lam)
    rest = w - ca.jtimes(w, node.v, node.v)
    w0 = ca.substitute([rest], [node.lam], [ca.SX.zeros(node.lam.numel())])[0]
    if rows and _depends(ca.horzcat(W, L), ca.vertcat(node.lam, node.a)):
        raise KembaError(labels[0], "the pairs are not linear in the forces")
    for i in gaps:
        W[i, :] = ca.jacobian(w[i], node.q)
        w0[i] = 0
    gap = ca.SX(ca.vertcat(*(w[i] for i in gaps))) if gaps else ca.SX.zeros(0, 1)
    group = np.array([order.index(name) for name in instances], dtype=int)
    return PairTable(
        labels, gap, np.array(gaps, dtype=int), group, W, L, w0, _free_speeds(W, L, gaps, group)
    )


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
