"""First-order chambers (paper, eq. 4 and 5)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from typing_extensions import Self

from kemba.effects.base import At, Contribution, Effect
from kemba.effects.pneumatics.tables import at_supply, beyond, filled
from kemba.quantity import Param, Quantity, Tolerance

if TYPE_CHECKING:
    from kemba.mechanism import Cylinder

Newton = Annotated[float, Param("N", 10.0, lower=0.0, doc="of Table II")]
Pascal = Annotated[float, Param("Pa", 1e4, lower=0.0, doc="pressure")]
Second = Annotated[float, Param("s", 2e-3, lower=0.0, doc="of Table I")]

OF_A_KIND = Tolerance(0.02, source="assumed: parts of one make differ by 1 to 3 %")
ENTRY = Tolerance(0.02, each=True, source="assumed: parts of one make differ by 1 to 3 %")


STEADY = ("F_extend", "F_retract")
FIGURES = ("pressures", *STEADY, "fill", "vent")


class Chamber(Effect):
    """Force of each chamber answers its valve as a first-order lag.

    `F_extend`, `F_retract`: steady forces at the supply pressures `pressures` (Table II),
    interpolated. `fill`, `vent`: time constants at empty and full chamber (Table I); the
    retract chamber's own extension is stroke - x. Other figures are those of the
    robot's cylinder.
    """

    pressures: tuple[Pascal, ...] | None = None
    F_extend: tuple[Newton, ...] | None = None
    F_retract: tuple[Newton, ...] | None = None
    fill: tuple[Second, Second] | None = None
    vent: tuple[Second, Second] | None = None

    family = "air"
    equation = "F = F_static u - tau(u, x) dF/dt; effort F_e - F_r"
    source = "paper eq. 4, 5, Tables I, II"
    ports = ("piston",)
    reads = ("supply_gain", "droop", "rise_gain")
    publishes = ("F_static_e", "F_static_r", "tau_e", "tau_r")

    nominal: ClassVar[dict[str, Tolerance]] = {
        "F_extend": OF_A_KIND,
        "F_retract": OF_A_KIND,
        "fill": ENTRY,
        "vent": ENTRY,
    }

    def of_cylinder(self, cylinder: Cylinder) -> Self:
        return filled(self, cylinder, FIGURES, STEADY)

    def remarks(self, supply: float) -> list[str]:
        return beyond(self, supply, STEADY)

    def states(self) -> dict[str, Quantity]:
        top = 1.3 * max(self.value("F_extend") or (math.inf,))
        return {
            "F_e": Quantity("chamber/extend/F", "N", 0.0, top, 100.0, doc="extend chamber"),
            "F_r": Quantity("chamber/retract/F", "N", 0.0, top, 100.0, doc="retract chamber"),
        }

    def rise_time(self, u: Any, x: Any, stroke: float) -> Any:
        """tau(u, x) [s], bilinear in the valve and in the chamber's own extension (eq. 5)."""
        ends = self.value("vent"), self.value("fill")
        vent, fill = (empty + (full - empty) * x / stroke for empty, full in ends)
        return vent + u * (fill - vent)

    def evaluate(self, at: At) -> Contribution:
        x = at.piston.x
        sides = {
            "F_extend": ("e", x, at.u_e, at.F_e),
            "F_retract": ("r", at.stroke - x, at.u_r, at.F_r),
        }
        rate, publish = {}, dict[str, Any]()
        for table, (c, way, u, F) in sides.items():
            tau = at.rise_gain * self.rise_time(u, way, at.stroke)
            static = at.supply_gain * at_supply(self, table, at.supply)
            rate[f"F_{c}"] = (at.droop * static * u - F) / tau
            publish |= {f"F_static_{c}": static, f"tau_{c}": tau}
        return Contribution({"piston": at.F_e - at.F_r}, rate, publish=publish)
