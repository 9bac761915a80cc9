"""Ground that is not the rigid, grippy floor of the planning model."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal

import casadi as ca

from kemba.effects.base import At, Contribution, Effect, Pair, Signal
from kemba.effects.mechanics.contact import Contact
from kemba.quantity import Param, Quantity

SMOOTH = 0.01  # width of the smoothed `never pulling`, in units of the damping factor


class GroundFriction(Effect):
    """The floor grips less, or more, than the friction coefficient of the contact says."""

    kind: Literal["ground_friction"] = "ground_friction"
    mu: Annotated[float, Param("1", 0.4, lower=0.0, doc="friction coefficient, nominal 1")] = 1.0

    family: ClassVar[str] = "ground"
    equation: ClassVar[str] = "|lam_t| <= mu lam_n instead of lam_n"
    source: ClassVar[str] = "authors' program: coefficient 1.0"
    ports: ClassVar[tuple[str, ...]] = ("foot_x", "foot_z")
    off: ClassVar[dict[str, float]] = {"mu": 1.0}

    def signals(self, at: At) -> dict[str, Signal]:
        return {"mu_gain": Signal(gain=self.mu)}


class GroundCompliance(Effect):
    """A springy, damped floor instead of the rigid one: never pulling, Coulomb friction.

    Written like the rigid contact with the penetration that the force needs added to the gap,
    so that k -> infinity is the rigid contact. `mu` is the friction coefficient of this floor.
    """

    kind: Literal["ground_compliance"] = "ground_compliance"
    k: Annotated[float, Param("N.m-1", 2e4, lower=100.0, doc="stiffness")] = 2e4
    d: Annotated[float, Param("s.m-1", 1.0, lower=0.0, doc="damping per stiffness")] = 1.0
    mu: Annotated[float, Param("1", 0.4, lower=0.0, doc="friction coefficient")] = 1.0

    family: ClassVar[str] = "ground"
    equation: ClassVar[str] = "lam_n = max(0, k pen (1 + d pen')), pen = max(0, h(x) - z)"
    source: ClassVar[str] = "Hunt and Crossley 1975, with a linear spring"
    ports: ClassVar[tuple[str, ...]] = ("foot_x", "foot_z")
    reads: ClassVar[tuple[str, ...]] = ("mu_gain",)
    replaces: ClassVar[tuple[str, ...]] = ("contact",)
    off: ClassVar[dict[str, float]] = {"k": math.inf}
    mirror: ClassVar[dict[str, str]] = Contact.mirror

    def forces(self) -> dict[str, Quantity]:
        return Contact().forces()

    def penetration(self, force: Any, rate: Any) -> Any:
        """Depth at which the floor gives `force` while the foot sinks at `rate`."""
        growth = 1 + self.d * rate
        positive = (growth + ca.sqrt(growth**2 + SMOOTH**2)) / 2  # never pulling
        return force / (self.k * positive)

    def evaluate(self, at: At) -> Contribution:
        rigid = Contact(mu=1.0).bind({"mu": self.mu}).evaluate(at)
        sinking = at.ground.slope(at.foot_x.x) * at.foot_x.v - at.foot_z.v
        pairs = [
            Pair("gap", p.a + self.penetration(at.lam_n, sinking), p.b) if p.name == "gap" else p
            for p in rigid.pairs
        ]
        return Contribution(effort=rigid.effort, pairs=pairs, outputs=rigid.outputs)
