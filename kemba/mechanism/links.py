"""The link table of a robot (configs/robots/*.yaml) as checked data."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict

from kemba.config import find_config, load_yaml, parse
from kemba.quantity import Param

Length = Annotated[float, Param("m", doc="length")]
Mass = Annotated[float, Param("kg", lower=0.0, doc="mass")]
Inertia = Annotated[float, Param("kg.m2", lower=0.0, doc="moment of inertia")]


class Table(BaseModel):
    """A frozen row of the link table; unknown keys are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Link(Table):
    """A rigid link; COM from its upper end (a rod: before its lower end), inertia at the COM."""

    mass: Mass
    inertia: Inertia
    com: Length = 0.0
    length: Length = 0.0


class Piston(Table):
    """Where the cylinder sits: pivot beside the hip, pin on the tibia, lengths pivot to pin."""

    mount: Length
    pin: Length
    retracted: Length
    stroke: Length


class Leg(Table):
    """One leg, used for every entry of `Robot.legs`."""

    femur: Link
    tibia: Link
    cylinder: Link
    rod: Link
    piston: Piston
    rotor_inertia: Inertia = 0.0


class LegPlace(Table):
    """Where a leg hangs: hip position along the body, and the side to which its knee folds."""

    hip: Length
    fold: Literal[1, -1]


class Robot(Table):
    """A planar robot: one body, legs of one kind."""

    name: str
    gravity: Annotated[float, Param("m.s-2", lower=0.0, doc="gravity")] = 9.81
    body: Link
    legs: dict[str, LegPlace]
    leg: Leg


def load_robot(name: str = "kemba") -> Robot:
    """The link table `name`, a path or a shipped robot. Raises KembaError."""
    return parse(load_yaml(find_config(name, "robots")), Robot)
