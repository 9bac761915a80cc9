"""Requirements: what a task asks, on a model's quantities and at moments of the motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import ceil, floor

import casadi as ca

from kemba.config.document import Location, written
from kemba.model import Model
from kemba.ocp.task.expressions import is_expression, symbolic
from kemba.quantity import Quantity
from kemba.scene import POINTS

# How much of each unit matters in a requirement; other units have the scale of the quantity.
SCALES = {"m": 0.1, "rad": 0.2, "m.s-1": 1.0, "rad.s-1": 5.0}
ROUND = 1e-9  # nodes; above rounding errors


@dataclass(frozen=True)
class Earlier:
    """What a requirement between two moments subtracts: a quantity at another moment."""

    name: str
    at: float
    acts: bool = False

    def node(self, nodes: int) -> int:
        """The node at which it is; what acts has none before the first interval's end."""
        return max(int(self.acts), round(self.at * nodes))


@dataclass(frozen=True)
class Requirement:
    """lower <= quantity <= upper at one moment (fraction of the nodes) or, at None, throughout
    `during` (fractions of the nodes; the whole motion by default).

    The name of `quantity` may be an expression. Between two moments it is that of the later one,
    and `minus` is what is subtracted. `loose`: by how much a plan whose valves switch at nodes may
    be off; the refined plan, which times them, may not.

    `aim`: 1 where the quantity is to be as large as possible, -1 as small as possible, else 0.
    `acts`: whether it is an input or a force, which act on the interval before a node, or depends
    on one. `line`: the place in the task's file, `jump.yaml:31`.
    """

    location: Location
    quantity: Quantity
    at: float | None
    lower: float
    upper: float
    during: tuple[float, float] = (0.0, 1.0)
    aim: int = 0
    acts: bool = False
    minus: Earlier | None = None
    loose: float = 0.0
    line: str = field(default="", compare=False)

    @property
    def label(self) -> str:
        """What is asked of what: `goals.apex:body/z`."""
        return f"{self.text}:{self.quantity.name}"

    @property
    def scale(self) -> float:
        """One unit of its violation, in the quantity's unit: the same in every program, in the
        elastic solve's prices and in the certificate."""
        return SCALES.get(self.quantity.unit, self.quantity.scale)

    @property
    def on_nodes(self) -> Requirement:
        """The same as a plan whose valves switch at nodes has to keep it."""
        return replace(self, lower=self.lower - self.loose, upper=self.upper + self.loose)

    @property
    def text(self) -> str:
        """Where the task asks for it, as people write it: `goals.apex`."""
        return written(self.location)

    def node(self, nodes: int) -> int:
        """The node at which it holds; what acts has none before the first interval's end."""
        return max(int(self.acts), round((self.at or 0.0) * nodes))

    def nodes(self, count: int) -> list[int]:
        """The nodes at which it holds on a grid of `count`: at least the nearest one."""
        if self.at is not None:
            return [self.node(count)]
        begin, end = (share * count for share in self.during)
        inside = range(max(int(self.acts), ceil(begin - ROUND)), floor(end + ROUND) + 1)
        return list(inside) or [max(int(self.acts), round((begin + end) / 2))]

    @property
    def always(self) -> bool:
        """Whether it holds throughout the motion."""
        return self.at is None and self.during == (0.0, 1.0)

    def holds(self, at: float) -> bool:
        """Whether it holds at a moment (fraction of the nodes)."""
        return self.at == at if self.at is not None else self.during[0] <= at <= self.during[1]


def quantities(model: Model) -> dict[str, Quantity]:
    """Every quantity that a task may name: coordinates, rates, ports, states, inputs, forces, and
    outputs of these."""
    mechanism, node = model.mechanism, model.node
    ports = [q for p in mechanism.ports.values() for q in (p.quantity, p.rate)]
    named = [quantity for group in model.groups.values() for quantity in group]
    changes = ca.vertcat(node.a, node.sd)
    of_these = [
        q for q in node.output_quantities if not ca.depends_on(ca.SX(node.outputs[q.name]), changes)
    ]
    known = {q.name: q for q in (*of_these, *ports, *named)}
    points = [f"{leg}/{point}" for leg in mechanism.legs for point in POINTS]
    # heights above the ground, where these are heights above 0
    return {**{f"{p}/gap": known[f"{p}/z"] for p in points if f"{p}/z" in known}, **known}


def quantity_expression(model: Model, name: str) -> ca.SX:
    """A quantity, or an expression of them, of the node's q, v, s, lam, u."""
    if is_expression(name):
        return symbolic(name, lambda part: quantity_expression(model, part))
    for group, quantities in model.groups.items():
        for i, quantity in enumerate(quantities):
            if quantity.name == name:
                return ca.SX(getattr(model.node, group)[i])
    level = f"{name.removesuffix('gap')}z"  # on level ground at 0 gaps are heights
    outputs = model.node.outputs
    return outputs[name if name in outputs else level]


def highest(requirements: Sequence[Requirement]) -> Requirement | None:
    """The goal, or without one the end, that asks for the greatest height of the body, the last of
    several; or None."""
    heights = (w for w in requirements if w.quantity.name == "body/z" and w.minus is None)
    high = [w for w in heights if w.at and w.lower > -math.inf]
    goals = [w for w in high if w.location[0] == "goals"]
    return max(reversed(goals or high), key=lambda w: w.lower, default=None)


def landing_nodes(requirements: Sequence[Requirement], nodes: int) -> list[int]:
    """The nodes of the landings: those after the highest goal of the body, or all without one; of a
    sequence those of each motion, which ends where its `end` is asked for."""
    ends = {r.node(nodes) for r in requirements if r.location[0] == "end"} | {nodes}
    found, begin = list[int](), 0
    for end in sorted(ends):
        own = [r for r in requirements if r.at is not None and begin < r.node(nodes) <= end]
        apex = highest(own)
        found += range((begin if apex is None else apex.node(nodes)) + 1, end + 1)
        begin = end
    return found
