"""The air that reaches the chambers: its pressure, its droop, its flow rate; tank and hose."""

from typing import Annotated, Any, ClassVar

import casadi as ca

from kemba.effects.base import AirEffect, At, Contribution, Effect, Signal
from kemba.effects.pneumatics.chamber import OF_A_KIND
from kemba.effects.pneumatics.flow import ATMOSPHERE, GAS, KAPPA, TEMPERATURE, mass_flow
from kemba.quantity import Param, Quantity, Tolerance


class SupplyScale(AirEffect):
    """The supply is stronger or weaker than the tables': both chambers' steady forces scale."""

    k: Annotated[float, Param("1", 0.1, lower=0.0, doc="scale of F_static, nominal 1")] = 1.0

    equation = "F_static -> k F_static, both chambers"
    source = "paper II-A (0.7 +- 0.1 MPa), Table II"

    def signals(self, at: At) -> dict[str, Signal]:
        return {"supply_gain": Signal(gain=self.k)}


class SupplyDroop(AirEffect):
    """One shared supply that every filling chamber draws down and the tank restores.

    s is the supply's level, 1 when rested.
    """

    D: Annotated[float, Param("1", 0.05, lower=0.0, doc="drop per filled chamber")] = 0.0
    T: Annotated[float, Param("s", 0.3, lower=1e-3, doc="recovery time")] = 0.3

    place = "body"
    equation = (
        "ds/dt = (1 - s)/T - D sum_c u_c max(0, s - F_c/F_static,c)/tau_c; F_static -> s F_static"
    )
    source = "paper Table II: the shortfall below pressure x area grows with flow"
    ports = ()

    def states(self) -> dict[str, Quantity]:
        return {"s": Quantity("supply/s", "1", 0.0, 1.5, 0.1, 1.0, doc="supply level, 1 rested")}

    def signals(self, at: At) -> dict[str, Signal]:
        return {"droop": Signal(gain=at.s)}

    def evaluate(self, at: At) -> Contribution:
        drawn: Any = 0.0
        for leg in at.legs:
            drawn += leg.u_e * ca.fmax(0, at.s - leg.F_e / leg.F_static_e) / leg.tau_e
            drawn += leg.u_r * ca.fmax(0, at.s - leg.F_r / leg.F_static_r) / leg.tau_r
        return Contribution(rate={"s": (1 - at.s) / self.T - self.D * drawn})


class RiseTimeScale(AirEffect):
    """Chambers fill and vent slower (k > 1) or faster than Table I."""

    k: Annotated[float, Param("1", 0.25, lower=0.05, doc="scale of tau, nominal 1")] = 1.0

    equation = "tau_c -> k tau_c"
    source = "paper eq. 4, 5, Table I: other valves or tubing than the authors'"

    def signals(self, at: At) -> dict[str, Signal]:
        return {"rise_gain": Signal(gain=self.k)}


class SupplyLine(Effect):
    """A tank feeds one hose, the hose feeds every chamber; both lose pressure to what they give.

    Levels s are gauge pressures over the nominal one, 1 when rested. The compressor is too slow
    to matter within a jump. Needs physical chambers, whose mass flow it balances.
    """

    a: Annotated[float, Param("m2", 1e-6, lower=0.0, doc="orifice from tank to hose")] = 3.48e-6
    V: Annotated[float, Param("m3", 5e-5, lower=1e-6, doc="hose volume")] = 0.15e-3
    V_tank: Annotated[float, Param("m3", 0.05, lower=1e-4, doc="tank volume")] = 0.1

    place = "body"
    family = "air"
    equation = (
        "dP/dt = kappa R T (a phi(P_tank, P) - sum_c mdot_c)/V, "
        "dP_tank/dt = -kappa R T a phi(P_tank, P)/V_tank; P_s = P"
    )
    source = "paper II-A (100 L tank), eq. 1-3; hose of 3 m, 8 mm assumed"

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
