"""What the scene of a task means for its requirements: names, lines that cannot be, ground."""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace

from kemba.config import Document
from kemba.config.document import written
from kemba.errors import KembaError
from kemba.model import Model
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.task import Task
from kemba.quantity import Quantity

STANDS = 1e-6  # m; a foot that is asked to be lower than this above the ground stands


def scene_errors(task: Task, document: Document) -> list[KembaError]:
    """Lines of terrain and obstacles that overlap."""
    return [
        document.error(place, f"{written(place)}: {what}") for place, what in task.scene.faults()
    ]


def rooms(model: Model, known: dict[str, Quantity]) -> Iterator[tuple[int, Quantity]]:
    """Every distance from an obstacle that must not be negative, with the obstacle's number."""
    for i in range(len(model.mechanism.scene.obstacles)):
        for name, quantity in known.items():
            if name.endswith(f"/room{i or ''}"):
                yield i, quantity


def off_walls(requirement: Requirement, known: dict[str, Quantity]) -> list[Requirement]:
    """A height above the ground that must not be less than some length, as that distance from every
    part of ground with walls, where heights jump from node to node; else the requirement itself."""
    place, _, what = requirement.quantity.name.rpartition("/")
    parts = distances(place, known) if what == "gap" else []
    least = requirement.lower > 0.0 and requirement.upper == math.inf
    if not parts or not least or requirement.minus or requirement.aim:
        return [requirement]
    return [replace(requirement, quantity=part) for part in parts]


def distances(place: str, known: dict[str, Quantity]) -> list[Quantity]:
    """How far a point is from every part of ground with walls; none without walls."""
    names = (name for name in known if re.fullmatch(rf"{place}/distance\d*", name))
    return [known[name] for name in names]


SINKS = 1e-3  # m; a foot that stands on a part of the ground keeps to it by its contact alone


def feet_off_walls(model: Model, known: dict[str, Quantity]) -> list[Requirement]:
    """Feet beside walls or above them, also where no `clearance` is asked: of a motion that grazes
    one an execution runs into it."""
    return [
        Requirement(("terrain",), part, None, -SINKS, math.inf)
        for leg in model.mechanism.legs
        for part in distances(f"{leg}/foot", known)
    ]


def ground_at(model: Model, requirements: Sequence[Requirement], at: float) -> float:
    """Height [m] of the ground under the body where it is asked to be at a moment, else at the
    start, else at x = 0."""
    places = [r for r in requirements if r.quantity.name == "body/x" and r.lower == r.upper]
    here = [r.lower for moment in (at, 0.0) for r in places if r.at == moment]
    return float(model.mechanism.scene.ground.height(here[0] if here else 0.0))


def stands(model: Model, requirement: Requirement) -> bool:
    """Whether it asks for a foot that stands on the ground."""
    place, _, what = requirement.quantity.name.rpartition("/")
    level = model.mechanism.scene.ground.level
    if not place.endswith("foot") or (what, level) == ("z", None):
        return False
    return what in ("z", "gap") and requirement.upper - (level or 0.0) * (what == "z") <= STANDS
