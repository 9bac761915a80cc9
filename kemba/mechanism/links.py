"""The link table of a robot (configs/robots/*.yaml) as checked data."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from kemba.config import Section
from kemba.mechanism.cylinder import Cylinder, CylinderTable
from kemba.quantity import Param

Length = Annotated[float, Param("m", doc="length")]
Mass = Annotated[float, Param("kg", lower=0.0, doc="mass")]
Inertia = Annotated[float, Param("kg.m2", lower=0.0, doc="moment of inertia")]


# part, as row/field of a leg in the link table: `femur/length` -> true minus nominal [m], a number
# or a symbol
Offsets = Mapping[str, Any]
SPLIT = "legs/mass"  # another part: mass [kg] that is in the legs and not in the body
LINKS = ("femur", "tibia", "cylinder", "rod")
RESERVED = ("body", "supply", "piston")  # first parts of columns that belong to no leg


class Link(Section):
    """A rigid link; COM from its upper end (a rod: before its lower end), inertia at the COM."""

    mass: Mass
    inertia: Inertia
    com: Length = 0.0
    length: Length = 0.0


class Piston(Section):
    """Where the cylinder sits: pivot beside the hip, pin on the tibia, length from pivot to pin
    with the rod in."""

    mount: Length
    pin: Length
    retracted: Length


class Leg(Section):
    """One leg, used for every entry of `Robot.legs`."""

    femur: Link
    tibia: Link
    cylinder: Link
    rod: Link
    piston: Piston
    rotor_inertia: Inertia = 0.0


class LegPlace(Section):
    """Where a leg hangs: hip position along the body, and the side to which its knee folds."""

    hip: Length
    fold: Literal[1, -1]


Share = Annotated[float, Param("1", lower=0.0, upper=0.1, doc="1 sigma, as a share of the figure")]


class LinkTolerances(Section):
    """How well masses and moments of inertia of the links are known; 0: exactly.

    2 % is assumed: figures from drawings are off by 1 to 3 %.
    """

    mass: Share = 0.02
    inertia: Share = 0.02


class Robot(Section):
    """A planar robot: one body, one to three legs of one kind, one kind of cylinder."""

    name: str
    gravity: Annotated[float, Param("m.s-2", lower=0.0, doc="gravity")] = 9.81
    body: Link
    legs: Annotated[dict[str, LegPlace], Field(min_length=1, max_length=3)]
    leg: Leg
    cylinder: Cylinder
    tolerances: LinkTolerances = LinkTolerances()

    @field_validator("legs")
    @classmethod
    def _named(cls, legs: dict[str, LegPlace]) -> dict[str, LegPlace]:
        for name in legs:
            if not name.isidentifier() or name in RESERVED:
                raise ValueError(
                    f"'{name}' cannot be the name of a leg; a word such as left, other than "
                    f"{', '.join(RESERVED)}, was expected"
                )
        return legs

    @property
    def stroke(self) -> float:
        """Way of every piston [m]."""
        return self.cylinder.stroke


class RobotFile(Robot):
    """A robot as its YAML writes it: figures of the cylinder may be left to another cylinder."""

    cylinder: CylinderTable  # type: ignore[assignment]


def altered(robot: Robot, offsets: Offsets) -> Robot:
    """The robot with its lengths changed by `offsets`; masses and centres of mass stay, but for
    mass that `SPLIT` moves.

    Offsets may be symbols; the result is then not checked, and only for expressions.
    """
    robot = _split(robot, offsets[SPLIT]) if SPLIT in offsets else robot
    leg = robot.leg
    for part, d in offsets.items():
        if part == SPLIT:
            continue
        row, name = part.split("/")
        table = getattr(leg, row)
        table = table.model_copy(update={name: getattr(table, name) + d})
        leg = leg.model_copy(update={row: table})
    return robot.model_copy(update={"leg": leg})


def _split(robot: Robot, m: Any) -> Robot:
    """The robot with mass m [kg] in the links of its legs and not in its body."""
    carried = len(robot.legs) * sum(getattr(robot.leg, row).mass for row in LINKS)
    links = {row: _heavier(getattr(robot.leg, row), 1 + m / carried) for row in LINKS}
    body = _heavier(robot.body, 1 - m / robot.body.mass)
    return robot.model_copy(update={"body": body, "leg": robot.leg.model_copy(update=links)})


def _heavier(link: Link, factor: Any) -> Link:
    """The link with `factor` times its mass, in the same shape."""
    masses = {"mass": factor * link.mass, "inertia": factor * link.inertia}
    return link.model_copy(update=masses)


def nominal_length(leg: Leg, part: str) -> float:
    """Length [m] of a part as the link table has it."""
    row, name = part.split("/")
    return float(getattr(getattr(leg, row), name))
