"""A robot whose lengths differ from those of its drawing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from kemba.mechanism.links import Leg, Robot
from kemba.mechanism.recursion import Joint

# part, as row/field of a leg in the link table: `femur/length` -> true minus nominal [m], a number
# or a symbol
Offsets = Mapping[str, Any]


def altered(robot: Robot, offsets: Offsets) -> Robot:
    """The robot with its lengths changed by `offsets`; masses and centres of mass stay.

    Offsets may be symbols; the result is then not checked, and only for expressions.
    """
    leg = robot.leg
    for part, d in offsets.items():
        row, name = part.split("/")
        table = getattr(leg, row)
        table = table.model_copy(update={name: getattr(table, name) + d})
        leg = leg.model_copy(update={row: table})
    return robot.model_copy(update={"leg": leg})


def placed(joints: list[Joint], robot: Robot) -> list[Joint]:
    """The joints at the places that the lengths of `robot` give them, which may be symbols."""
    offsets: dict[str, Any] = {}
    for name, place in robot.legs.items():
        offsets[f"{name}/knee"] = (0.0, -robot.leg.femur.length)
        offsets[f"{name}/cylinder"] = (place.fold * robot.leg.piston.mount, 0.0)
    return [replace(j, offset=offsets.get(j.name, j.offset)) for j in joints]


def nominal_length(leg: Leg, part: str) -> float:
    """Length [m] of a part as the link table has it."""
    row, name = part.split("/")
    return float(getattr(getattr(leg, row), name))
