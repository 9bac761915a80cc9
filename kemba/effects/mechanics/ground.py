"""Foot contact: the rigid ground with Coulomb friction, and ground that differs from it."""

import math
from typing import Annotated, Any, ClassVar

import casadi as ca

from kemba.effects.base import At, Contribution, Effect, GroundEffect, Pair, Signal
from kemba.quantity import Param, Quantity


class Contact(Effect):
    """Foot on rigid ground: normal force against gap, friction cone against slip.

    The gap is the height above the ground under the foot; forces and slip are in the frame of the
    ground there. `gamma` is the slip speed; friction is split into its forward and backward part.
    `mu` holds where the terrain says no other.
    """

    mu: Annotated[float, Param("1", 0.4, lower=0.0, doc="friction coefficient")] = 1.0

    family = "ground"
    equation = "0 <= z - h(x) _|_ lam_n >= 0; |lam_t| <= mu lam_n, slip against it"
    source = "paper IV-A.1 with the contact-implicit method of its ref. 24"
    ports = ("foot_x", "foot_z")
    reads = ("mu_gain",)
    mirror: ClassVar[dict[str, str]] = {"lam_p": "lam_m", "lam_m": "lam_p"}

    def forces(self) -> dict[str, Quantity]:
        force = 5000.0
        return {
            "lam_n": Quantity("foot/Fz", "N", 0.0, force, 50.0, doc="normal force"),
            "lam_p": Quantity("foot/Fx_forward", "N", 0.0, force, 50.0, doc="friction, forward"),
            "lam_m": Quantity("foot/Fx_backward", "N", 0.0, force, 50.0, doc="friction, backward"),
            "gamma": Quantity("foot/slip", "m.s-1", 0.0, 50.0, 1.0, doc="slip speed"),
        }

    def evaluate(self, at: At) -> Contribution:
        ground, x, gamma = at.ground, at.foot_x.x, at.gamma
        across, up = ground.normal(x)
        push = at.lam_p - at.lam_m
        slip = up * at.foot_x.v - across * at.foot_z.v
        cone = at.mu_gain * ground.friction(x, self.mu) * at.lam_n - at.lam_p - at.lam_m
        return Contribution(
            effort={
                "foot_z": up * at.lam_n - across * push,
                "foot_x": across * at.lam_n + up * push,
            },
            pairs=(
                Pair("gap", at.foot_z.x - ground.height(x), at.lam_n),
                Pair("cone", gamma, cone, unit_a="m.s-1"),
                Pair("slip forward", gamma + slip, at.lam_p, unit_a="m.s-1"),
                Pair("slip backward", gamma - slip, at.lam_m, unit_a="m.s-1"),
            ),
            outputs=((Quantity("foot/Fx", "N", doc="force along the ground"), push),),
        )


SMOOTH = 0.01  # width of the smoothed `never pulling`, in units of the damping factor


class GroundCompliance(GroundEffect):
    """A springy, damped floor instead of the rigid one: never pulling, Coulomb friction.

    Written like the rigid contact with the penetration that the force needs added to the gap,
    so that k -> infinity is the rigid contact. `mu` is the friction coefficient of this floor.
    """

    k: Annotated[float, Param("N.m-1", 2e4, lower=100.0, doc="stiffness")] = 2e4
    d: Annotated[float, Param("s.m-1", 1.0, lower=0.0, doc="damping per stiffness")] = 1.0
    mu: Annotated[float, Param("1", 0.4, lower=0.0, doc="friction coefficient")] = 1.0

    equation = "lam_n = max(0, k pen (1 + d pen')), pen = max(0, h(x) - z)"
    source = "Hunt and Crossley 1975, with a linear spring"
    reads = ("mu_gain",)
    replaces = ("contact",)
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


class GroundFriction(GroundEffect):
    """The floor grips less, or more, than the friction coefficient of the contact says."""

    mu: Annotated[float, Param("1", 0.4, lower=0.0, doc="friction coefficient, nominal 1")] = 1.0

    equation = "|lam_t| <= mu lam_n instead of lam_n"
    source = "authors' program: coefficient 1.0"

    def signals(self, at: At) -> dict[str, Signal]:
        return {"mu_gain": Signal(gain=self.mu)}
