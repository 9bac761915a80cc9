"""What the scene of a task means for its requirements: names, lines that cannot be, ground."""

from collections.abc import Iterator, Sequence

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
    """Every height above an obstacle that must not be negative, with the obstacle's number."""
    for i in range(len(model.mechanism.scene.obstacles)):
        for name, quantity in known.items():
            if name.endswith(f"/room{i or ''}"):
                yield i, quantity


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
