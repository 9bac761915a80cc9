"""From a task's names to requirements on a model's quantities, every mistake at its line."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from math import ceil, floor

import casadi as ca

from kemba.config import Document
from kemba.config.document import Location, written
from kemba.errors import ConfigErrors, KembaError, suggest
from kemba.model import Model
from kemba.ocp.task.height import longest_leg, with_height
from kemba.ocp.task.options import cost_errors, option_errors, timing_errors
from kemba.ocp.task.task import Bound, Goal, Task
from kemba.ocp.task.terrain import ground_at, heights_above, rooms, scene_errors
from kemba.quantity import Quantity, to_si

# `rest`: every rate is zero; `settled`: every state of an effect is where it comes to rest
SPECIAL = ("rest", "settled")
# How much of each unit matters in a requirement; other units have the scale of the quantity.
SCALES = {"m": 0.1, "rad": 0.2, "m.s-1": 1.0, "rad.s-1": 5.0}
FLIGHT = 0.7  # the part of the flight in which `clearance` holds; feet come down in the rest
ROUND = 1e-9  # nodes; above rounding errors
UNREFINED = "needs the refined plan, and this task says refine: none"
MOMENTS = {"start": 0.0, "middle": 0.5, "end": 1.0}


@dataclass(frozen=True)
class Requirement:
    """lower <= quantity <= upper at one moment (fraction of the nodes) or, at None, throughout
    `during` (fractions of the nodes; the whole motion by default).

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
    line: str = field(default="", compare=False)

    @property
    def scale(self) -> float:
        """One unit of its violation, in the quantity's unit: the same in every program, in the
        elastic solve's prices and in the certificate."""
        return SCALES.get(self.quantity.unit, self.quantity.scale)

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
    """Every quantity that a task may name: coordinates, rates, ports, states, inputs, forces."""
    mechanism = model.mechanism
    own = [*mechanism.coordinates, *mechanism.velocities]
    ports = [q for p in mechanism.ports.values() for q in (p.quantity, p.rate)]
    groups = (model.states, model.inputs, model.forces)
    named = [q for group in groups for q in group.values()]
    known = {q.name: q for q in (*ports, *own, *named)}
    return {**heights_above(model, known), **known}


def quantity_expression(model: Model, name: str) -> ca.SX:
    """The quantity as an expression of the node's q, v, s, lam, u."""
    node, mechanism = model.node, model.mechanism
    groups = [
        (mechanism.coordinates, node.q),
        (mechanism.velocities, node.v),
        (model.states.values(), node.s),
        (model.forces.values(), node.lam),
        (model.inputs.values(), node.u),
    ]
    for group, symbol in groups:
        for i, quantity in enumerate(group):
            if quantity.name == name:
                return symbol[i]
    return node.outputs[name]


class NotGivenError(ValueError):
    """What a requirement needs is not in the task."""


def resolve(
    task: Task, model: Model, document: Document, partial: bool = False
) -> list[Requirement]:
    """All requirements of a task. `partial`: nothing is said of what the task does not give.

    Raises ConfigErrors with every wrong name, unit or range, of its costs and solver options too.
    """
    known, task = quantities(model), with_height(task, model)
    requirements: list[Requirement] = []
    errors: list[KembaError] = []
    for location, pattern, at, bound in _asked(task):
        try:
            for quantity in _matching(pattern, known, model):
                requirements.append(_requirement(task, location, quantity, at, bound))
        except KembaError as error:
            place = (*location, "quantity") if isinstance(bound, Goal) else location
            errors.append(document.error(place, f"{written(place)}: {error.what}", hint=error.hint))
        except ValueError as error:
            if not (partial and isinstance(error, NotGivenError)):
                errors.append(document.error(location, f"{written(location)}: {error}"))
    apex = highest(requirements)
    read = not errors and not partial  # else the goal may be one that was not read
    for key, of_the_flight in (("feet", feet_at_apex), ("clearance", flight_clearance)):
        try:
            requirements += of_the_flight(task, model, apex, ground_at(model, requirements, 0.0))
        except ValueError as error:
            if read:
                errors.append(document.error((key,), f"{key}: {error}"))
    if task.grip < 1.0 and task.refine == "none":
        errors.append(document.error(("grip",), f"grip: {UNREFINED}"))
    errors += cost_errors(task.cost, document)
    errors += option_errors(task.solver.options, document)
    errors += timing_errors(task, document)
    errors += scene_errors(task, document)
    if errors:
        raise ConfigErrors(errors)
    requirements += [
        Requirement(("obstacles", i), room, None, 0.0, math.inf) for i, room in rooms(model, known)
    ]
    acting = _acting(model, {r.quantity.name for r in requirements})
    return [
        replace(r, acts=r.quantity.name in acting, line=document.place(r.location))
        for r in requirements
    ]


def _acting(model: Model, names: Iterable[str]) -> set[str]:
    """The quantities that inputs or forces decide."""
    causes = ca.vertcat(model.node.u, model.node.lam)
    return {n for n in names if ca.depends_on(ca.SX(quantity_expression(model, n)), causes)}


Asked = tuple[Location, str, float | None, Bound | Goal]


def _asked(task: Task) -> Iterator[Asked]:
    for side, at in (("start", 0.0), ("end", 1.0)):
        for name, bound in getattr(task, side).items():
            yield (side, name), name, at, bound
    for name, bound in task.bounds.items():
        yield ("bounds", name), name, None, bound
    for name, goal in task.goals.items():
        at = goal.at if isinstance(goal.at, float | int) else MOMENTS[goal.at]
        yield ("goals", name), goal.quantity, float(at), goal


def _matching(pattern: str, known: dict[str, Quantity], model: Model) -> list[Quantity]:
    if pattern == "rest":
        return list(model.mechanism.velocities)
    if pattern == "settled":
        return list(model.states.values())
    found = [q for name, q in known.items() if fnmatchcase(name, pattern)]
    if not found:
        hint = suggest(pattern, (*known, *SPECIAL))
        raise KembaError("", f"unknown quantity '{pattern}'", hint=hint)
    return found


def _requirement(
    task: Task, location: Location, quantity: Quantity, at: float | None, bound: Bound | Goal
) -> Requirement:
    if location[-1] in SPECIAL:
        if bound.equals is not True and bound.equals != 1:
            raise ValueError(f"'{location[-1]}' is either true or left out")
        value = 0.0 if location[-1] == "rest" else quantity.value
        return Requirement(location, quantity, at, value, value)
    during, aim = (0.0, 1.0), 0
    if isinstance(bound, Goal):
        during = bound.during or during
        at = None if bound.during else at
        aim = int(bound.maximise) - int(bound.minimise)
    if bound.equals is not None:
        if bound.at_least is not None or bound.at_most is not None:
            raise ValueError("'equals' does not go with 'at_least' or 'at_most'")
        value = _number(task, bound.equals, quantity)
        return Requirement(location, quantity, at, value, value, during, aim)
    lower = -math.inf if bound.at_least is None else _number(task, bound.at_least, quantity)
    upper = math.inf if bound.at_most is None else _number(task, bound.at_most, quantity)
    if lower == -math.inf and upper == math.inf and not aim:
        raise ValueError("asks for nothing; 'equals', 'at_least' or 'at_most' was expected")
    if lower > upper:
        raise ValueError(f"at_least {lower:g} is above at_most {upper:g} {quantity.unit}")
    return Requirement(location, quantity, at, lower, upper, during, aim)


def highest(requirements: Sequence[Requirement]) -> Requirement | None:
    """The goal, or without one the end, that asks for the greatest height of the body, or None."""
    high = [w for w in requirements if w.quantity.name == "body/z" and w.at and w.lower > -math.inf]
    goals = [w for w in high if w.location[0] == "goals"]
    return max(goals or high, key=lambda w: w.lower, default=None)


def apex_node(requirements: Sequence[Requirement], nodes: int) -> int:
    """The node of the highest goal of the body, after which it lands; 0 without such a goal."""
    apex = highest(requirements)
    return 0 if apex is None else apex.node(nodes)


def flight_clearance(
    task: Task, model: Model, apex: Requirement | None, ground: float
) -> list[Requirement]:
    """Every foot at least as high as the task's clearance in the middle of the flight.

    The flight is the ballistic one about the highest goal of the body, from stretched legs on
    `ground` [m]; of it the middle part counts. A flight that is longer than the motion fills it;
    that the duration is too short is said by the checks. Without `folding`, a jump too low for the
    clearance has what stretched legs leave: nothing where they reach the ground. Raises ValueError
    where no goal says
    when the robot flies.
    """
    if not task.clearance:
        return []
    if apex is None or apex.at is None:
        raise ValueError("needs a goal for body/z at the top of the flight")
    robot = model.mechanism.need_robot()
    above = apex.lower - robot.leg.femur.length - robot.leg.tibia.length - ground
    rise = math.sqrt(2 * max(above, task.clearance) / model.mechanism.gravity)
    rise /= task.duration
    before, after = min(rise, apex.at), min(rise, 1.0 - apex.at)
    during = apex.at - FLIGHT * before, apex.at + FLIGHT * after
    least = task.clearance
    if not task.folding:  # stretched legs have this at the first and last moment that counts
        least = min(least, (1.0 - FLIGHT**2) * (apex.lower - longest_leg(robot) - ground))
    known = quantities(model)
    return [
        Requirement(("clearance",), known[f"{leg}/foot/gap"], None, least, math.inf, during)
        for leg in (model.mechanism.legs if least > 0.0 else ())
    ]


def feet_at_apex(
    task: Task, model: Model, apex: Requirement | None, ground: float
) -> list[Requirement]:
    """Every foot as high above the ground as the task's `feet`, at the highest goal of the body.

    Raises ValueError where there is no such goal.
    """
    if task.feet is None:
        return []
    if apex is None:
        raise ValueError("needs a goal for body/z, at which the feet are to be so high")
    known = quantities(model)
    return [
        Requirement(("feet",), known[f"{leg}/foot/gap"], apex.at, task.feet, math.inf)
        for leg in model.mechanism.legs
    ]


def _number(task: Task, value: float | str, quantity: Quantity) -> float:
    if value in ("height", "distance"):
        number = getattr(task, str(value))
        if number is None:
            raise NotGivenError(f"refers to '{value}', which the task does not give")
        return float(number)
    return to_si(value, quantity.unit)
