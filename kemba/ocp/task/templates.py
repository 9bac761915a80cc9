"""Words of a task that stand for several requirements: `clearance`, `contacts`, `periodic`, ..."""

import itertools
import math
import operator
from collections.abc import Callable, Sequence

import numpy as np

from kemba.errors import suggest
from kemba.events import feet
from kemba.mechanism.knee import flexion
from kemba.mechanism.links import Robot
from kemba.model import Model
from kemba.model.rest import at_rest
from kemba.ocp.task.moments import spans
from kemba.ocp.task.requirement import Earlier, Requirement, highest, quantities
from kemba.ocp.task.task import Task
from kemba.ocp.task.terrain import ground_at
from kemba.trajectory import Trajectory

FLIGHT = 0.7  # the part of the flight in which `clearance` holds; feet come down in the rest
DIGITS = 6  # of a state at rest; equal legs differ by roundings
AFTER = 1e-6  # of the motion: forces act from the node after the one at which a part begins


def flight_clearance(task: Task, model: Model, others: Sequence[Requirement]) -> list[Requirement]:
    """Every foot at least as high as the task's clearance in the middle of the flight.

    With `contacts`, that is the middle of each of its flights, over the ground under it. Else the
    flight is the ballistic one about the highest goal of the body, from legs stretched on the
    ground at the start; of it the middle part counts. A flight that is longer than the motion fills
    it; that the duration is too short is said by the checks. Without `folding`, a jump too low for
    the clearance has what stretched legs leave: nothing where they reach the ground. Raises
    ValueError where no goal says when the robot flies.
    """
    apex = highest(others)
    if not task.clearance:
        return []
    if task.contacts:
        return _clear_swings(task, model)
    if apex is None or apex.at is None:
        raise ValueError("needs a goal for body/z at the top of the flight")
    robot = model.mechanism.need_robot()
    ground = ground_at(model, others, 0.0)
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


def _clear_swings(task: Task, model: Model) -> list[Requirement]:
    """The clearance in the middle of what a foot flies between two parts of `contacts`."""
    assert task.clearance is not None
    known, found = quantities(model), []
    for leg in model.mechanism.legs:
        gap, stands = known[f"{leg}/foot/gap"], [leg in part.on for part in task.contacts]
        parts = zip(stands, spans(task.contacts), strict=True)
        for on, run in itertools.groupby(parts, operator.itemgetter(0)):
            own = [span for _, span in run]
            begin, end = own[0][0], own[-1][1]
            middle, half = (begin + end) / 2, FLIGHT * (end - begin) / 2
            during = middle - half, middle + half
            if not on:
                asked = Requirement(("clearance",), gap, None, task.clearance, math.inf, during)
                found.append(asked)
    return found


def feet_at_apex(task: Task, model: Model, others: Sequence[Requirement]) -> list[Requirement]:
    """Every foot as high above the ground as the task's `feet`, at the highest goal of the body.
    Raises ValueError where there is no such goal."""
    apex = highest(others)
    if task.feet is None:
        return []
    if apex is None:
        raise ValueError("needs a goal for body/z, at which the feet are to be so high")
    known = quantities(model)
    return [
        Requirement(("feet",), known[f"{leg}/foot/gap"], apex.at, task.feet, math.inf)
        for leg in model.mechanism.legs
    ]


def standing_feet(task: Task, model: Model, others: Sequence[Requirement]) -> list[Requirement]:
    """The feet of every part of `contacts` on the ground, the others without force. Raises
    ValueError where a part names a leg that there is not, or shares do not add up."""
    if not task.contacts:
        return []
    legs, known, found = model.mechanism.legs, quantities(model), []
    for leg in (leg for part in task.contacts for leg in part.on if leg not in legs):
        raise ValueError(f"no leg '{leg}'; {suggest(leg, legs)}")
    for part, (begin, end) in zip(task.contacts, spans(task.contacts), strict=True):
        for leg in legs:
            stands = leg in part.on
            quantity = known[f"{leg}/foot/gap" if stands else f"{leg}/foot/Fz"]
            during = begin + AFTER, end
            found.append(Requirement(("contacts",), quantity, None, 0.0, 0.0, during))
    return found


def closed_in_itself(task: Task, model: Model, others: Sequence[Requirement]) -> list[Requirement]:
    """Every coordinate, rate, force of air and valve at the end as at the start. Raises ValueError
    where `except` names what there is not."""
    if task.periodic is None:
        return []
    excepted = task.periodic.excepted
    listed = [*model.state, *(q for q in model.inputs.values() if q.binary)]
    names = [q.name for q in listed]
    for name in (name for name in excepted if name not in names):
        raise ValueError(f"except: no state '{name}'; {suggest(name, names)}")
    return [
        Requirement(("periodic",), q, 1.0, 0.0, 0.0, minus=Earlier(q.name, 0.0))
        for q in listed
        if q.name not in excepted
    ]


def within_the_supply(task: Task, model: Model, others: Sequence[Requirement]) -> list[Requirement]:
    """What valves decide at rest, as pressures, no higher than there with valves all shut or all
    open, where a motion begins with it free: no plan begins with more air than there is."""
    if task.periodic is not None:
        return []
    standing = model.mechanism.standing
    q = [standing.get(c.name, c.value) for c in model.mechanism.coordinates]
    shut, full = (
        at_rest(model, q, [float(valves and i.binary) for i in model.inputs.values()])
        for valves in (False, True)
    )
    asked, found = {r.quantity.name for r in others if r.at == 0.0}, []
    for i, state in enumerate(model.states.values()):
        low, high = (round(float(x[i]) / state.scale, DIGITS) * state.scale for x in (shut, full))
        if low != high and state.name not in asked:
            found.append(Requirement(("start",), state, 0.0, -math.inf, max(low, high)))
    return found


Template = Callable[[Task, Model, Sequence[Requirement]], list[Requirement]]

# key of a task: what it stands for, given what the task asks by name
TEMPLATES: dict[str, Template] = {
    "feet": feet_at_apex,
    "clearance": flight_clearance,
    "contacts": standing_feet,
    "periodic": closed_in_itself,
    "start": within_the_supply,
}


def longest_leg(robot: Robot) -> float:
    """Distance [m] from hip to foot with the piston out."""
    femur, tibia = robot.leg.femur.length, robot.leg.tibia.length
    bend = math.cos(flexion(robot.leg, robot.stroke))
    return math.sqrt(femur**2 + tibia**2 + 2 * femur * tibia * bend)


def rise_of_feet(plan: Trajectory) -> float | None:
    """How far [m] all feet are off the ground at most; None where the columns do not say."""
    heights = [*feet(plan).values()]
    return float(np.min(heights, axis=0).max()) if heights else None


def with_height(task: Task, model: Model) -> Task:
    """The task with the height [m] of the body's centre at which the stretched legs of a level body
    leave its feet as high as `feet` asks; the task itself where it does not ask for that."""
    if task.feet is None:
        return task
    ground = float(task.scene.ground.height(0.0))
    height = task.feet + longest_leg(model.mechanism.need_robot()) + ground
    return task.model_copy(update={"height": height})
