"""Physics at the first node, before which there is no interval.

Inputs and forces act on the interval before a node, so that the first node has none, and the
equations of a step end at later nodes. What is true of every state still holds there: feet are not
below the ground, pistons are within their stroke, and limits hold without inputs.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from kemba.model import Node
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.transcription.layout import Layout

SAME = 1e-9  # relative; far above rounding errors


@dataclass(frozen=True)
class StateRow:
    """`expression` >= 0 of the node's q, v, s, in `unit`; `scale` is one unit of a violation."""

    kind: str
    label: str
    unit: str
    scale: float
    expression: ca.SX


def state_rows(
    node: Node, pairs: Sequence[int] | None = None, limits: Sequence[int] | None = None
) -> list[StateRow]:
    """What holds in every state: pairs' expressions of the state alone, and limits at zero inputs.

    `pairs`, `limits`: the rows to look at; all by default.
    """
    found = []
    for i in range(len(node.pair_rows)) if pairs is None else pairs:
        first, second = node.pair_rows[i]
        for row, scale, g in ((first, 1.0, node.pair_a[i]), (second, second.scale, node.pair_b[i])):
            if _of_the_state(node, g):
                found.append(StateRow("sign", row.label, row.unit, scale, g))
    for i in range(len(node.limit_rows)) if limits is None else limits:
        g = ca.substitute(node.limits[i], node.u, ca.SX.zeros(node.u.numel()))
        if _of_the_state(node, g):
            found.append(StateRow("limit", node.limit_rows[i].label, "1", 1.0, g))
    return found


def _of_the_state(node: Node, g: ca.SX) -> bool:
    state, others = ca.vertcat(node.q, node.v, node.s), [node.a, node.sd, node.lam, node.u]
    return bool(ca.depends_on(g, state) and not ca.depends_on(g, ca.vertcat(*others)))


def granted(g: ca.SX, y: ca.SX, layout: Layout, held: Sequence[tuple[ca.SX, Requirement]]) -> bool:
    """Whether g >= 0 follows from a requirement on an expression that is `held`: g is a multiple of
    that and a constant. Such a row would double the requirement: no multipliers were unique."""
    rng = np.random.default_rng(0)
    low, high = np.maximum(layout.lower, -1.0), np.minimum(layout.upper, 1.0)
    points = rng.uniform(low, np.maximum(low, high), (3, layout.size)).T
    for expression, requirement in held:
        both = ca.vertcat(g, expression)
        evaluate = ca.Function("both", [y], [both, ca.densify(ca.jacobian(both, y))])
        values, slopes = (np.array(part) for part in evaluate.map(points.shape[1])(points))
        slopes = slopes.reshape(2, -1)
        factor = float(slopes[0] @ slopes[1] / max(slopes[1] @ slopes[1], 1e-300))
        offset = values[0] - factor * values[1]
        size = SAME * max(1.0, float(np.abs(slopes[0]).max()))
        if np.abs(slopes[0] - factor * slopes[1]).max() > size or np.ptp(offset) > size:
            continue
        ends = [factor * end for end in (requirement.lower, requirement.upper)]
        if min(ends) + offset[0] >= -size:
            return True
    return False
