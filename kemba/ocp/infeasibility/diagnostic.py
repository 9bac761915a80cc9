"""What prevents a plan: a sentence, the requirement to relax, and how certain it is."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from kemba.config import Document
from kemba.config.document import Location, written
from kemba.ocp.task.requirement import Requirement


@dataclass(frozen=True)
class Relax:
    """A requirement that cannot be met: what the task asks, and what could be reached instead."""

    requirement: str
    where: str
    quantity: str
    asked: float
    reachable: float
    unit: str

    def __str__(self) -> str:
        """`goals.apex`: 1.45 m asked, 1.21 m is the most that can be reached."""
        end = "most" if self.asked > self.reachable else "least"
        asked, reachable = apart(self.asked, self.reachable, self.unit)
        name, said = f"`{self.requirement}`", (self.requirement.partition(".")[2], "")
        if self.quantity not in said and "*" not in self.requirement:
            name += f" ({self.quantity})"
        return f"{name}: {asked} asked, {reachable} is the {end} that can be reached"

    def placed(self, more: str = "") -> str:
        """The same with `more` behind it, and its place in the task, if it has one."""
        return f"{self}{more}" + (f" ({self.where})" if self.where else "")


@dataclass(frozen=True)
class Diagnostic:
    """What a check found.

    `certain`: no plan can exist, so that nothing is solved. `cause`: it names the cause, which is
    not the requirement that fails.
    """

    sentence: str
    certain: bool
    relax: tuple[Relax, ...] = ()
    cause: bool = False


def number(value: float, unit: str, digits: int = 3) -> str:
    """A value as people write it: `0.35 m`, `-10 deg`, `0`."""
    if unit == "rad":
        value, unit = math.degrees(value), "deg"
    text = f"{round(value, digits) + 0.0:.{digits + 1}g}"
    return text if unit == "1" else f"{text} {unit}"


def apart(asked: float, reachable: float, unit: str) -> tuple[str, str]:
    """Two values with as many digits as show that they differ."""
    pairs = ((number(asked, unit, d), number(reachable, unit, d)) for d in range(3, 9))
    return next((pair for pair in pairs if pair[0] != pair[1]), (f"{asked:g}", f"{reachable:g}"))


def place(document: Document, location: Location) -> str:
    """`jump.yaml:33:3`, or the `--set` option, where the task says so."""
    return document.error(location, "").where


def key(name: str, document: Document) -> str:
    """A top-level key of the task with its place: `payload` (jump.yaml:6:1)."""
    known = (name,) in document.marks or (name,) in document.overrides
    return f"`{name}` ({place(document, (name,))})" if known else f"`{name}`"


def relax(document: Document, requirement: Requirement, asked: float, reachable: float) -> Relax:
    """How far a requirement must be relaxed."""
    where, quantity = place(document, requirement.location), requirement.quantity
    return Relax(requirement.text, where, quantity.name, asked, reachable, quantity.unit)


def one_per_requirement(relaxed: Iterable[Relax]) -> tuple[Relax, ...]:
    """The farthest of every requirement: `*/foot/z` holds for two feet and is named once."""
    worst: dict[tuple[str, bool], Relax] = {}
    for r in relaxed:
        known = worst.setdefault((r.requirement, r.asked > r.reachable), r)
        if abs(r.asked - r.reachable) > abs(known.asked - known.reachable):
            worst[(r.requirement, r.asked > r.reachable)] = r
    return tuple(worst.values())


def spoken(location: Location) -> str:
    """A location between backticks."""
    return f"`{written(location)}`"
