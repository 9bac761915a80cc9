"""First-order chambers (paper, eq. 4 and 5)."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from kemba.effects.base import At, Contribution, Effect
from kemba.quantity import Param, Quantity, Tolerance

Newton = Annotated[float, Param("N", 10.0, lower=0.0, doc="of Table II")]
Pascal = Annotated[float, Param("Pa", 1e4, lower=0.0, doc="pressure")]
Second = Annotated[float, Param("s", 2e-3, lower=0.0, doc="of Table I")]

OF_A_KIND = Tolerance(0.02, source="assumed: parts of one make differ by 1 to 3 %")
ENTRY = Tolerance(0.02, each=True, source="assumed: parts of one make differ by 1 to 3 %")

TABLE_PRESSURES = (0.6e6, 0.7e6, 0.8e6)


def at_supply(supply: float, pressures: tuple[float, ...], table: tuple[Any, ...]) -> Any:
    """A table over supply pressures read at `supply`; its entries may be symbols."""
    weights = [np.interp(supply, pressures, row) for row in np.eye(len(pressures))]
    return sum(float(w) * value for w, value in zip(weights, table, strict=True))


class Chamber(Effect):
    """Force of each chamber answers its valve as a first-order lag.

    `F_extend`, `F_retract`: steady forces at the supply pressures `pressures` (Table II),
    interpolated. `fill`, `vent`: time constants at empty and full chamber (Table I); the
    retract chamber's own extension is stroke - x.
    """

    kind: Literal["chamber"] = "chamber"
    pressures: tuple[Pascal, ...] = TABLE_PRESSURES
    F_extend: tuple[Newton, ...] = (287.0, 324.0, 349.0)
    F_retract: tuple[Newton, ...] = (239.0, 260.0, 291.0)
    fill: tuple[Second, Second] = (0.008, 0.025)
    vent: tuple[Second, Second] = (0.013, 0.037)

    family: ClassVar[str] = "air"
    equation: ClassVar[str] = "F = F_static u - tau(u, x) dF/dt; effort F_e - F_r"
    source: ClassVar[str] = "paper eq. 4, 5, Tables I, II"
    ports: ClassVar[tuple[str, ...]] = ("piston",)
    reads: ClassVar[tuple[str, ...]] = ("supply_gain", "droop", "rise_gain")
    publishes: ClassVar[tuple[str, ...]] = (
        "F_static_e",
        "F_static_r",
        "tau_e",
        "tau_r",
    )

    nominal: ClassVar[dict[str, Tolerance]] = {
        "F_extend": OF_A_KIND,
        "F_retract": OF_A_KIND,
        "fill": ENTRY,
        "vent": ENTRY,
    }

    def states(self) -> dict[str, Quantity]:
        top = max(self.F_extend) * 1.3
        return {
            "F_e": Quantity("chamber/extend/F", "N", 0.0, top, 100.0, doc="extend chamber"),
            "F_r": Quantity("chamber/retract/F", "N", 0.0, top, 100.0, doc="retract chamber"),
        }

    def rise_time(self, u: Any, x: Any, stroke: float) -> Any:
        """tau(u, x) [s], bilinear in the valve and in the chamber's own extension (eq. 5)."""
        vent = self.vent[0] + (self.vent[1] - self.vent[0]) * x / stroke
        fill = self.fill[0] + (self.fill[1] - self.fill[0]) * x / stroke
        return vent + u * (fill - vent)

    def evaluate(self, at: At) -> Contribution:
        x = at.piston.x
        tau_e = at.rise_gain * self.rise_time(at.u_e, x, at.stroke)
        tau_r = at.rise_gain * self.rise_time(at.u_r, at.stroke - x, at.stroke)
        F_static_e = at.supply_gain * at_supply(at.supply, self.pressures, self.F_extend)
        F_static_r = at.supply_gain * at_supply(at.supply, self.pressures, self.F_retract)
        return Contribution(
            effort={"piston": at.F_e - at.F_r},
            rate={
                "F_e": (at.droop * F_static_e * at.u_e - at.F_e) / tau_e,
                "F_r": (at.droop * F_static_r * at.u_r - at.F_r) / tau_r,
            },
            publish={
                "F_static_e": F_static_e,
                "F_static_r": F_static_r,
                "tau_e": tau_e,
                "tau_r": tau_r,
            },
        )
