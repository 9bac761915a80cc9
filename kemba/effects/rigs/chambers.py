"""Chambers whose pressures are measured: no valves, the sensors say what pushes."""

from typing import Annotated, ClassVar, Literal

from kemba.effects.base import At, Contribution, Effect
from kemba.effects.mechanics.laws import dahl_rate
from kemba.effects.pneumatics.flow import ATMOSPHERE
from kemba.quantity import Param, Quantity, Tolerance

SIDES = {"extend": "P_e", "retract": "P_r"}


class MeasuredChambers(Effect):
    """Pressure times area from measured pressures; the rig brings it along.

    `chambers` that are not measured are open to the air. `gain` scales both areas at once: the
    bore is known to a tolerance. Seals stretch before they slide: friction turns round within
    `travel`, with z the stretch (1 when sliding, Dahl's law).
    """

    chambers: tuple[Literal["extend", "retract"], ...] = ("extend", "retract")
    gain: float = 1.0
    travel: Annotated[float, Param("m", 1e-4, lower=1e-7, doc="travel until seals slide")] = 2.5e-4

    family = "air"
    equation = (
        "A_e (P_e - P_atm) - A_r (P_r - P_atm); travel dz/dt = v - abs(v) z, z for tanh(v/0.01)"
    )
    source = "pressure times area; P. R. Dahl, A solid friction model, 1968"
    ports = ("piston",)
    publishes = ("F_e", "F_r", "sense")
    nominal: ClassVar[dict[str, Tolerance]] = {
        "gain": Tolerance(0.003, source="derived: bores of ISO 15552 are H11, 25 mm +0.13 mm")
    }

    def states(self) -> dict[str, Quantity]:
        return {"z": Quantity("piston/stretch", "1", -1.0, 1.0, 1.0, doc="stretch of the seals")}

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
            rate={"z": dahl_rate(at.z, at.piston.v, self.travel)},
            publish={"F_e": push["extend"], "F_r": push["retract"], "sense": at.z},
        )
