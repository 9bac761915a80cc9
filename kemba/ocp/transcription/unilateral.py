"""The unilateral constraints of a model: feet on the ground and pistons at their stops."""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from kemba.model import Model, Node
from kemba.ocp.transcription.symmetry import Reduction


@dataclass(frozen=True)
class Friction:
    """Friction of a contact as expressions of the node: `slip` speed [m/s], and what is left of
    the cone [N] forward and backward. `forward`, `backward`, `speed`: places in lam."""

    slip: ca.SX
    cone_forward: ca.SX
    cone_backward: ca.SX
    forward: int
    backward: int
    speed: int


@dataclass(frozen=True)
class Constraint:
    """A gap [m] of the node's q, its rate [m/s], the force that holds it (place in lam)."""

    label: str
    gap: ca.SX
    rate: ca.SX
    force: int
    friction: Friction | None


def read_constraints(model: Model, reduction: Reduction) -> list[Constraint]:
    """The constraints of a model that its half (or whole) problem keeps. Raises ValueError where a
    pair is neither a gap with a force nor the friction of one."""
    found = rigid_constraints(model, reduction)
    covered = sum(4 if c.friction else 1 for c in found)
    if covered != len(reduction.pairs):
        raise ValueError("has pairs other than rigid contacts and stops")
    return found


def rigid_constraints(model: Model, reduction: Reduction) -> list[Constraint]:
    """Those of them that are gaps with a force: not the contacts of a ground that gives way."""
    node = model.node
    by_owner: dict[str, dict[str, int]] = {}
    for i in reduction.pairs:
        owner, name = node.pair_rows[i][0].label.rsplit(":", 1)
        by_owner.setdefault(owner, {})[name] = i
    found = []
    for owner, rows in by_owner.items():
        friction = _friction(node, rows, owner)
        for name, i in rows.items():
            force = _place(node, node.pair_b[i])
            if force is None or not _is_gap(node, node.pair_a[i]):
                continue
            gap = node.pair_a[i]
            rate = ca.jtimes(gap, node.q, node.v)
            found.append(Constraint(f"{owner}:{name}", gap, rate, force, friction))
    return found


def _friction(node: Node, rows: dict[str, int], owner: str) -> Friction | None:
    if "cone" not in rows:
        return None
    cone, slip = node.pair_b[rows["cone"]], node.pair_a[rows["slip forward"]]
    places = [_place(node, node.pair_b[rows[f"slip {way}"]]) for way in ("forward", "backward")]
    speed = _place(node, node.pair_a[rows["cone"]])
    if speed is None or None in places:
        raise ValueError(f"'{owner}' has friction of an unknown form")
    forward, backward = (int(p) for p in places if p is not None)
    zero = ca.SX(0)
    ahead = ca.substitute(cone, node.lam[backward], zero)
    behind = ca.substitute(ca.substitute(cone, node.lam[forward], zero), node.lam[backward],
                           -node.lam[forward])  # fmt: skip
    slip = ca.substitute(slip, node.lam[speed], zero)
    return Friction(slip, ahead, behind, forward, backward, speed)


def _place(node: Node, expression: ca.SX) -> int | None:
    places = range(node.lam.numel())
    return next((i for i in places if ca.is_equal(expression, node.lam[i])), None)


def _is_gap(node: Node, expression: ca.SX) -> bool:
    others = ca.vertcat(node.v, node.s, node.lam, node.u)
    return bool(np.all(~np.array(ca.which_depends(expression, others, 1, True))))
