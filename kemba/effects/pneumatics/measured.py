"""Chambers whose pressures are measured: no valves, the sensors say what pushes."""

from __future__ import annotations

from typing import ClassVar, Literal

from kemba.effects.base import At, Contribution, Effect
from kemba.effects.pneumatics.constants import ATMOSPHERE
from kemba.quantity import Quantity, Tolerance

SIDES = {"extend": "P_e", "retract": "P_r"}


class MeasuredChambers(Effect):
    """Pressure times area from measured pressures; the rig brings it along.

    `chambers` that are not measured are open to the air. `gain` scales both areas at once: the
    bore is known to a tolerance.
    """

    kind: Literal["measured_chambers"] = "measured_chambers"
    chambers: tuple[Literal["extend", "retract"], ...] = ("extend", "retract")
    gain: float = 1.0

    family: ClassVar[str] = "air"
    equation: ClassVar[str] = "A_e (P_e - P_atm) - A_r (P_r - P_atm)"
    source: ClassVar[str] = "pressure times area"
    ports: ClassVar[tuple[str, ...]] = ("piston",)
    publishes: ClassVar[tuple[str, ...]] = ("F_e", "F_r")
    nominal: ClassVar[dict[str, Tolerance]] = {
        "gain": Tolerance(0.003, source="derived: bores of ISO 15552 are H11, 25 mm +0.13 mm")
    }

    def inputs(self) -> dict[str, Quantity]:
        return {
            SIDES[side]: Quantity(
                f"chamber/{side}/P", "Pa", scale=2e5, value=ATMOSPHERE, doc=f"{side}, absolute"
            )
            for side in self.chambers
        }

    def evaluate(self, at: At) -> Contribution:
        areas = {"extend": at.cylinder.area_extend, "retract": at.cylinder.area_retract}
        push = dict.fromkeys(SIDES, 0.0)
        for side in self.chambers:
            push[side] = self.gain * areas[side] * (getattr(at, SIDES[side]) - ATMOSPHERE)
        return Contribution(
            effort={"piston": push["extend"] - push["retract"]},
            publish={"F_e": push["extend"], "F_r": push["retract"]},
        )
