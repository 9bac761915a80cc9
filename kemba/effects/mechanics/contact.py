"""Rigid unilateral foot contact with Coulomb friction."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from kemba.effects.base import At, Contribution, Effect, Pair
from kemba.quantity import Param, Quantity


class Contact(Effect):
    """Foot on rigid ground: normal force against gap, friction cone against slip.

    The gap is the height above the ground under the foot; forces and slip are in the frame of the
    ground there. `gamma` is the slip speed; friction is split into its forward and backward part.
    `mu` holds where the terrain says no other.
    """

    kind: Literal["contact"] = "contact"
    mu: Annotated[float, Param("1", 0.4, lower=0.0, doc="friction coefficient")] = 1.0

    family: ClassVar[str] = "ground"
    equation: ClassVar[str] = "0 <= z - h(x) _|_ lam_n >= 0; |lam_t| <= mu lam_n, slip against it"
    source: ClassVar[str] = "paper IV-A.1 with the contact-implicit method of its ref. 24"
    ports: ClassVar[tuple[str, ...]] = ("foot_x", "foot_z")
    reads: ClassVar[tuple[str, ...]] = ("mu_gain",)
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
