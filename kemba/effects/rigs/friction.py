"""Friction of a drive: bearings, screws, belts and gears."""

from typing import Annotated, ClassVar

import casadi as ca

from kemba.effects.base import At, AxisEffect, Contribution
from kemba.effects.mechanics.laws import coulomb, dahl_rate, fading, one_way, viscous
from kemba.quantity import Param, Quantity

SURVEY = "B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994)"


class AxisFriction(AxisEffect):
    """Coulomb friction of bearings, screw and guides."""

    F_c: Annotated[float, Param("N", 10.0, lower=0.0, doc="Coulomb force", rotary="N.m")] = 0.0
    w: Annotated[float, Param("1", lower=0.01, doc="how smoothly it turns over")] = 1.0

    equation = "-F_c tanh(v/(w sign_speed))"
    source = SURVEY
    dissipative = True
    law_of = "sliding of the axis"

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"axis": coulomb(self.F_c, at.axis.v, self.w * at.sign_speed)})


class AxisDamping(AxisEffect):
    """Viscous friction: grease, and currents that the motion induces."""

    F_v: Annotated[
        float, Param("N.s.m-1", 50.0, lower=0.0, doc="damping", rotary="N.m.s.rad-1")
    ] = 0.0

    equation = "-F_v v"
    source = SURVEY
    dissipative = True

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"axis": viscous(self.F_v, at.axis.v)})


class AxisDirection(AxisEffect):
    """Viscous friction that differs by direction: by d more forward, by d less back."""

    d: Annotated[float, Param("N.s.m-1", 20.0, doc="half the difference", rotary="N.m.s.rad-1")] = (
        0.0
    )

    equation = "-d abs(v)"
    source = "A. Janot, M. Gautier, M. Brunot, EMPS benchmark, 2019 (asymmetric friction)"

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"axis": -self.d * ca.fabs(at.axis.v)})


class AxisOneWay(AxisEffect):
    """Coulomb friction that differs by direction: by F_d more forward, by F_d less back.

    While the axis moves it looks like `axis_offset`; only at rest do the two differ.
    """

    F_d: Annotated[float, Param("N", 5.0, doc="half the difference", rotary="N.m")] = 0.0

    equation = "-F_d tanh(v/sign_speed)^2"
    source = SURVEY

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"axis": one_way(self.F_d, at.axis.v, at.sign_speed)})


class AxisStribeck(AxisEffect):
    """Extra friction near standstill that fades as lubricant is drawn in."""

    F_s: Annotated[
        float, Param("N", 10.0, lower=0.0, doc="extra force near standstill", rotary="N.m")
    ] = 0.0
    v_b: Annotated[
        float, Param("m.s-1", 0.02, lower=1e-5, doc="rate at which it fades", rotary="rad.s-1")
    ] = 0.02

    equation = "-F_s exp(-(v/v_b)^2) tanh(v/sign_speed)"
    source = SURVEY
    dissipative = True

    def evaluate(self, at: At) -> Contribution:
        extra = self.F_s * fading(at.axis.v, self.v_b)
        return Contribution(effort={"axis": coulomb(extra, at.axis.v, at.sign_speed)})


class GearFriction(AxisEffect):
    """Friction of gear teeth, which the force of inertia and load presses together."""

    mu: Annotated[float, Param("1", 0.1, lower=0.0, upper=1.0, doc="share of the force")] = 0.0

    equation = "-mu abs(J a + load) tanh(v/sign_speed)"
    source = "load-dependent friction of gears: M. Gautier, A. Jubien, A. Janot, ICRA 2012"
    dissipative = True

    def evaluate(self, at: At) -> Contribution:
        pressed = self.mu * ca.fabs(at.carried)
        return Contribution(effort={"axis": coulomb(pressed, at.axis.v, at.sign_speed)})


class Presliding(AxisEffect):
    """Contacts that stretch before they slide; z is the stretch, 1 when sliding (Dahl's law).

    With a short travel it is Coulomb friction.
    """

    F_p: Annotated[float, Param("N", 10.0, lower=0.0, doc="force when sliding", rotary="N.m")] = 0.0
    travel: Annotated[
        float, Param("m", 1e-4, lower=1e-7, doc="travel until it slides", rotary="rad")
    ] = 2e-4

    equation = "-F_p z, travel dz/dt = v - abs(v) z"
    law_of = AxisFriction.law_of
    source = "P. R. Dahl, A solid friction model, Aerospace Corporation, 1968"
    mirror: ClassVar[dict[str, str]] = {"z": "-z"}

    def states(self) -> dict[str, Quantity]:
        return {"z": Quantity("axis/stretch", "1", -1.0, 1.0, 1.0, doc="stretch of contacts")}

    def evaluate(self, at: At) -> Contribution:
        return Contribution(
            effort={"axis": -self.F_p * at.z}, rate={"z": dahl_rate(at.z, at.axis.v, self.travel)}
        )
