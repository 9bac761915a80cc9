"""Friction of the piston's seals."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from kemba.effects.base import At, Contribution, Effect
from kemba.effects.mechanics.laws import fading
from kemba.quantity import Param

V_COULOMB = 0.01  # m.s-1; below it the sign of v is smoothed


class SealFriction(Effect):
    """Coulomb friction of the piston's seals."""

    kind: Literal["seal_friction"] = "seal_friction"
    F_c: Annotated[float, Param("N", 10.0, lower=0.0, doc="Coulomb force")] = 0.0

    family: ClassVar[str] = "piston"
    equation: ClassVar[str] = "-F_c tanh(v/0.01)"
    source: ClassVar[str] = "paper Table II: 6-8 N are missing at every pressure, both valves on"
    ports: ClassVar[tuple[str, ...]] = ("piston",)
    off: ClassVar[dict[str, float]] = {"F_c": 0.0}
    dissipative: ClassVar[bool] = True

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"piston": -self.F_c * at.sense})


class StribeckFriction(Effect):
    """Extra friction near standstill that fades as the seal's lubricating film builds up."""

    kind: Literal["stribeck_friction"] = "stribeck_friction"
    F_s: Annotated[float, Param("N", 10.0, lower=0.0, doc="extra force near standstill")] = 0.0
    v_b: Annotated[float, Param("m.s-1", 0.05, lower=1e-3, doc="rate at which it fades")] = 0.05

    family: ClassVar[str] = "piston"
    equation: ClassVar[str] = "-F_s exp(-(v/v_b)^2) tanh(v/0.01)"
    source: ClassVar[str] = "Stribeck curve of lubricated rubber seals"
    ports: ClassVar[tuple[str, ...]] = ("piston",)
    off: ClassVar[dict[str, float]] = {"F_s": 0.0}
    dissipative: ClassVar[bool] = True

    def evaluate(self, at: At) -> Contribution:
        force = self.F_s * fading(at.piston.v, self.v_b)
        return Contribution(effort={"piston": -force * at.sense})


class PressureFriction(Effect):
    """Friction of lip seals, which the air presses against bore and rod."""

    kind: Literal["pressure_friction"] = "pressure_friction"
    mu: Annotated[float, Param("1", 0.04, lower=0.0, doc="friction per chamber force")] = 0.0

    family: ClassVar[str] = "piston"
    equation: ClassVar[str] = "-mu (F_e + F_r) tanh(v/0.01)"
    source: ClassVar[str] = "lip seals: contact force proportional to pressure"
    ports: ClassVar[tuple[str, ...]] = ("piston",)
    off: ClassVar[dict[str, float]] = {"mu": 0.0}
    dissipative: ClassVar[bool] = True

    def evaluate(self, at: At) -> Contribution:
        load = self.mu * (at.F_e + at.F_r)
        return Contribution(effort={"piston": -load * at.sense})


class DirectionFriction(Effect):
    """Seals whose lips hold harder one way: more friction when extending by F_d, less by F_d when
    retracting. While the piston moves, it looks like a force sensor whose zero is off."""

    kind: Literal["direction_friction"] = "direction_friction"
    F_d: Annotated[float, Param("N", 3.0, doc="half the difference, extending less retracting")] = (
        0.0
    )

    family: ClassVar[str] = "piston"
    equation: ClassVar[str] = "-F_d tanh(v/0.01)^2"
    source: ClassVar[str] = (
        "asymmetric lips of seals and wipers: H. K. Mueller, B. S. Nau, Fluid Sealing Technology"
    )
    ports: ClassVar[tuple[str, ...]] = ("piston",)
    off: ClassVar[dict[str, float]] = {"F_d": 0.0}
    own_rigs: ClassVar[bool] = True

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"piston": -self.F_d * at.sense**2})
