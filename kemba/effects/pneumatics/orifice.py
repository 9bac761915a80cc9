"""Physical chambers: thermodynamics behind orifices (paper, eq. 1 to 3)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from typing_extensions import Self

from kemba.effects.base import At, Contribution, Effect
from kemba.effects.pneumatics.chamber import OF_A_KIND, Pascal, at_supply, beyond, filled, pressure
from kemba.effects.pneumatics.flow import (
    ATMOSPHERE,
    CHOKED,
    GAS,
    KAPPA,
    TEMPERATURE,
    mass_flow,
    phi,
)
from kemba.effects.pneumatics.gas import Air
from kemba.quantity import Param, Quantity, Tolerance

if TYPE_CHECKING:
    from kemba.mechanism import Cylinder

Area = Annotated[float, Param("m2", 1e-6, lower=0.0, doc="effective orifice area")]
Volume = Annotated[float | None, Param("m3", 3e-6, lower=1e-7, doc="tubing and ports")]


class OrificeChamber(Effect):
    """Pressure of each chamber behind a 3/2 valve: u joins it to the supply, 1 - u to the air.

    Eq. 1 is printed with a plus before dV/dt; compression raises the pressure, so it is a minus
    here. `gauge` is what reaches the valves at the supply pressures `pressures`, above the
    atmosphere. Dead volumes `V_e`, `V_r` are at x = 0 and at full stroke, unless given that of the
    cylinder's tubes; its areas are A_e and A_r. The flow is eq. 2 and 3.
    """

    a_fill: Area = 4.63e-6
    a_vent: Area = 3.99e-6
    V_e: Volume = None
    V_r: Volume = None
    n: Annotated[float, Param("1", 0.1, lower=1.0, upper=KAPPA, doc="polytropic exponent")] = 1.27
    pressures: tuple[Pascal, ...] = (0.6e6, 0.7e6, 0.8e6)
    gauge: tuple[Pascal, ...] = (0.572e6, 0.634e6, 0.696e6)

    family = "air"
    equation = (
        "dP/dt = n (R T mdot - P dV/dt)/V, mdot = u a_fill phi(P_s, P) - (1-u) a_vent phi(P, P_atm)"
        "; effort A_e (P_e - P_atm) - A_r (P_r - P_atm)"
    )
    source = "paper eq. 1-3 (its ref. 9), fitted to Tables I, II"
    ports = ("piston",)
    reads = ("supply_gain", "droop", "rise_gain")
    publishes: ClassVar[tuple[str, ...]] = (
        *("F_e", "F_r", "F_static_e", "F_static_r", "tau_e", "tau_r"),
        *("draw_e", "draw_r", "full"),
        *("air_e", "air_r", "exponent"),
    )
    carried_by: ClassVar[dict[str, str]] = {"F_e": "P_e", "F_r": "P_r"}
    replaces: ClassVar[tuple[str, ...]] = ("chamber", "mode_damping")
    nominal: ClassVar[dict[str, Tolerance]] = dict.fromkeys(
        ("gauge", "a_fill", "a_vent", "V_e", "V_r"), OF_A_KIND
    )

    def of_cylinder(self, cylinder: Cylinder) -> Self:
        open_ = {name: cylinder.tube for name in ("V_e", "V_r") if getattr(self, name) is None}
        return filled(self.model_copy(update=open_), cylinder, (), ("gauge",))

    def remarks(self, supply: float) -> list[str]:
        return beyond(self, supply, ("gauge",))

    def states(self) -> dict[str, Quantity]:
        return {f"P_{side[0]}": pressure(side) for side in ("extend", "retract")}

    def rate(self, P: Any, V: Any, dV: Any, inflow: Any) -> Any:
        """dP/dt [Pa.s-1] of a chamber of volume V [m3] (eq. 1)."""
        return self.n * (GAS * TEMPERATURE * inflow - P * dV) / V

    def filling_time(self, V: Any, full: Any, gain: Any) -> Any:
        """Time [s] to 63 % of the gauge pressure `full` at the choked rate from empty."""
        choked = phi(ATMOSPHERE + full, 0.5 * CHOKED * (ATMOSPHERE + full)) * self.a_fill / gain
        return (1 - math.exp(-1)) * V * full / (self.n * GAS * TEMPERATURE * choked)

    def evaluate(self, at: At) -> Contribution:
        x, v, bore = at.piston.x, at.piston.v, at.cylinder.bore
        full = at.supply_gain * at_supply(self, "gauge", at.supply)
        P_s = ATMOSPHERE + at.droop * full
        a_fill, a_vent = self.a_fill / at.rise_gain, self.a_vent / at.rise_gain
        sides = {
            "extend": ("e", at.cylinder.area_extend, x, v, at.u_e, at.P_e),
            "retract": ("r", at.cylinder.area_retract, at.stroke - x, -v, at.u_r, at.P_r),
        }
        rate, publish, outputs = {}, {"full": full, "exponent": self.n}, []
        for name, (c, A, way, out, u, P) in sides.items():
            V, F = self.value(f"V_{c}") + A * way, A * (P - ATMOSPHERE)
            draw = u * mass_flow(a_fill, P_s, P)
            vent = (1 - u) * mass_flow(a_vent, P, ATMOSPHERE)
            rate[f"P_{c}"] = self.rate(P, V, A * out, draw - vent)
            publish |= {
                f"F_{c}": F,
                f"F_static_{c}": A * full,
                f"tau_{c}": self.filling_time(V, full, at.rise_gain),
                f"draw_{c}": draw,
                f"air_{c}": Air(P, V, A * out, draw, vent, 4 * V / bore + 2 * A),
            }
            outputs.append((Quantity(f"chamber/{name}/F", "N", doc=f"{name} chamber"), F))
        effort = {"piston": publish["F_e"] - publish["F_r"]}
        return Contribution(effort, rate, publish=publish, outputs=outputs)
