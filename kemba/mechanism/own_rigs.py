"""Rigs of the user's own: a cylinder with measured pressures, a drive, a vessel (key `rig`)."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

import casadi as ca
from pydantic import Field, model_validator

from kemba.config import Section
from kemba.mechanism.cylinder import Bore, Cylinder
from kemba.mechanism.links import Mass
from kemba.mechanism.planar import Mechanism, Port
from kemba.quantity import Param, Quantity

GRAVITY = 9.81  # m.s-2

Rod = Annotated[float, Param("m", lower=0.0, upper=1.0, doc="diameter; 0: no rod in a chamber")]
Length = Annotated[float, Param("m", lower=1e-7, upper=0.1, doc="travel until seals slide")]
Speed = Annotated[float, Param("m.s-1", lower=1e-7, doc="sign is smooth within", rotary="rad.s-1")]
Moving = Annotated[float, Param("kg", lower=1e-9, doc="what moves", rotary="kg.m2")]
Arm = Annotated[float, Param("m", lower=1e-6, doc="centre of mass from the axis")]
Volume = Annotated[float, Param("m3", lower=1e-9, doc="inside")]
Area = Annotated[float, Param("m2", lower=1e-9, doc="inner wall")]
Opening = Annotated[float, Param("m", lower=1e-6, upper=1.0, doc="diameter")]
Share = Annotated[float, Param("1", lower=0.01, upper=1.0, doc="flow over ideal flow")]
Pascal = Annotated[float, Param("Pa", lower=0.0, doc="absolute pressure")]
Kelvin = Annotated[float, Param("K", lower=150.0, upper=600.0, doc="temperature")]


class CylinderRig(Bore):
    """A cylinder whose motion, force and chamber pressures are measured.

    `rod`: diameter where it passes the retract chamber. `chambers`: those whose pressure is
    measured; the other one is open to the air. `seal_travel`: way after a turn within which the
    seals stretch before they slide.
    """

    kind: Literal["cylinder"] = "cylinder"
    rod: Rod = 0.0
    chambers: tuple[Literal["extend", "retract"], ...] = Field(
        default=("extend", "retract"), min_length=1, max_length=2
    )
    seal_travel: Length | None = None
    sign_speed: Speed = 1e-3

    @property
    def stretch(self) -> float:
        """Travel [m] until seals slide: 1 % of the bore unless given (a ring's cord is a tenth of
        the bore, and shears by a tenth of itself)."""
        return self.seal_travel or 0.01 * self.bore

    @model_validator(mode="after")
    def _consistent(self) -> CylinderRig:
        if self.rod >= self.bore:
            raise ValueError("`rod` must be thinner than `bore`")
        if len(set(self.chambers)) < len(self.chambers):
            raise ValueError("`chambers` names one chamber twice")
        return self


class Load(Section):
    """What hangs on a drive: a weight that it lifts, or with `arm` a pendulum that it turns."""

    mass: Mass
    arm: Arm | None = None


class DriveRig(Section):
    """One axis with a motor: position and force (linear) or torque (rotary) are measured.

    `inertia` [kg or kg.m2] of all that moves but the load. A linear axis lifts its load against
    gravity where q grows; the load of a rotary axis hangs straight down at q = 0.
    """

    kind: Literal["drive"] = "drive"
    motion: Literal["linear", "rotary"] = "linear"
    inertia: Moving
    load: Load | None = None
    sign_speed: Speed | None = None

    @model_validator(mode="after")
    def _consistent(self) -> DriveRig:
        if self.load is not None and (self.load.arm is None) != (self.motion == "linear"):
            raise ValueError("`load` has an `arm` on a rotary axis, and none on a linear one")
        return self

    @property
    def speed(self) -> float:
        """Rate within which the sign of friction is smooth: 1 mm/s or 0.01 rad/s unless given."""
        return self.sign_speed or (1e-3 if self.motion == "linear" else 1e-2)


class VesselRig(Section):
    """A vessel of fixed volume that blows down through an orifice; P and T are measured.

    `wall`: area of the inner wall, unless given that of a sphere of this volume, the least there
    is. `outside`: the pressure behind the orifice; `ambient`: the temperature of the wall.
    """

    kind: Literal["vessel"] = "vessel"
    volume: Volume
    orifice: Opening
    discharge: Share = 0.84
    wall: Area | None = None
    outside: Pascal = 101325.0
    ambient: Kelvin = 293.0

    @property
    def area(self) -> float:
        """Area of the inner wall [m2]."""
        return self.wall or (36.0 * math.pi * self.volume**2) ** (1.0 / 3.0)


OwnRig = Annotated[CylinderRig | DriveRig | VesselRig, Field(discriminator="kind")]


def own_mechanism(rig: CylinderRig | DriveRig | VesselRig) -> Mechanism:
    """The rig as a mechanism whose motion is given: `piston/x`, `axis/q`, or nothing moves."""
    facts: dict[str, Any] = {"name": f"{rig.kind} rig", "rig": rig.kind, "gravity": GRAVITY}
    if isinstance(rig, CylinderRig):
        x = Quantity("piston/x", "m", -math.inf, math.inf, 0.02, doc="piston extension")
        rate = Quantity("piston/v", "m.s-1", -5.0, 5.0, 0.1, doc="piston rate")
        pressures = {f"chamber/{side}/P": "Pa" for side in rig.chambers}
        logged = {"piston/x": "m", "piston/F": "N", **pressures}
        return _one_axis(x, rate, logged=logged, sign_speed=rig.sign_speed, bore=rig, **facts)
    if isinstance(rig, DriveRig):
        unit, force = ("m", "N") if rig.motion == "linear" else ("rad", "N.m")
        q = Quantity("axis/q", unit, -math.inf, math.inf, 0.1, doc="position of the axis")
        rate = Quantity("axis/v", f"{unit}.s-1", -math.inf, math.inf, 0.1, doc="its rate")
        logged = {"axis/q": unit, "axis/tau": force}
        return _one_axis(q, rate, logged=logged, sign_speed=rig.speed, **facts)
    still = Quantity("vessel/x", "m", 0.0, 0.0, 1.0, doc="nothing moves here")
    rate = Quantity("vessel/v", "m.s-1", 0.0, 0.0, 1.0, doc="nothing moves here")
    logged = {"vessel/P": "Pa", "vessel/T": "K"}
    return _one_axis(still, rate, logged=logged, sign_speed=1.0, **facts)


def rig_mechanism(cylinder: Cylinder) -> Mechanism:
    """A piston on the bench: one coordinate, its extension `piston/x` [m], massless."""
    x = Quantity("piston/x", "m", 0.0, cylinder.stroke, 0.02, doc="piston extension, 0 retracted")
    rate = Quantity("piston/v", "m.s-1", -5.0, 5.0, 0.5, doc="piston rate")
    # nothing hangs on the rod
    return _one_axis(x, rate, name="rig", gravity=0.0, cylinder=cylinder)


def _one_axis(place: Quantity, rate: Quantity, **facts: Any) -> Mechanism:
    """A mechanism of one coordinate whose motion is imposed; `facts`: what else it is."""
    q, v, a = ca.SX.sym("q"), ca.SX.sym("v"), ca.SX.sym("a")
    return Mechanism(
        q=q,
        v=v,
        a=a,
        coordinates=(place,),
        velocities=(rate,),
        inverse_dynamics=ca.SX.zeros(1),
        ports={place.name: Port(place, rate, q)},
        legs=("",),
        imposed=True,
        **facts,
    )
