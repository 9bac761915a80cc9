"""The compressor's tank and the hose from it to the valves, for physical chambers."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from kemba.effects.base import At, Contribution, Effect, Signal
from kemba.effects.pneumatics.chamber import OF_A_KIND
from kemba.effects.pneumatics.constants import ATMOSPHERE, GAS, KAPPA, TEMPERATURE
from kemba.effects.pneumatics.flow import mass_flow
from kemba.quantity import Param, Quantity, Tolerance


class SupplyLine(Effect):
    """A tank feeds one hose, the hose feeds every chamber; both lose pressure to what they give.

    Levels s are gauge pressures over the nominal one, 1 when rested. The compressor is too slow
    to matter within a jump. Needs physical chambers, whose mass flow it balances.
    """

    kind: Literal["supply_line"] = "supply_line"
    a: Annotated[float, Param("m2", 1e-6, lower=0.0, doc="orifice from tank to hose")] = 3.48e-6
    V: Annotated[float, Param("m3", 5e-5, lower=1e-6, doc="hose volume")] = 0.15e-3
    V_tank: Annotated[float, Param("m3", 0.05, lower=1e-4, doc="tank volume")] = 0.1

    place: ClassVar[Literal["leg", "body"]] = "body"
    family: ClassVar[str] = "air"
    equation: ClassVar[str] = (
        "dP/dt = kappa R T (a phi(P_tank, P) - sum_c mdot_c)/V, "
        "dP_tank/dt = -kappa R T a phi(P_tank, P)/V_tank; P_s = P"
    )
    source: ClassVar[str] = "paper II-A (100 L tank), eq. 1-3; hose of 3 m, 8 mm assumed"

    nominal: ClassVar[dict[str, Tolerance]] = dict.fromkeys(("a", "V"), OF_A_KIND)

    def states(self) -> dict[str, Quantity]:
        return {
            "s_line": Quantity("supply/line/s", "1", 0.0, 1.5, 0.1, 1.0, doc="hose level"),
            "s_tank": Quantity("supply/tank/s", "1", 0.0, 1.5, 0.1, 1.0, doc="tank level"),
        }

    def signals(self, at: At) -> dict[str, Signal]:
        return {"droop": Signal(gain=at.s_line)}

    def evaluate(self, at: At) -> Contribution:
        drawn: Any = sum(leg.draw_e + leg.draw_r for leg in at.legs)
        full = at.legs[0].full
        fed = mass_flow(self.a, ATMOSPHERE + at.s_tank * full, ATMOSPHERE + at.s_line * full)
        per_mass = KAPPA * GAS * TEMPERATURE / full
        return Contribution(
            rate={
                "s_line": per_mass * (fed - drawn) / self.V,
                "s_tank": -per_mass * fed / self.V_tank,
            }
        )
