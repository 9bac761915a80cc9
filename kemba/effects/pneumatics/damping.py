"""Mode-dependent damping of the double-acting piston (paper, eq. 6 and 7)."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from kemba.effects.base import At, Contribution, Effect
from kemba.effects.pneumatics.chamber import TABLE_PRESSURES, Pascal, at_supply
from kemba.quantity import Param, Tolerance

Damping = Annotated[float, Param("N.s.m-1", 10.0, lower=0.0, doc="of Table II")]


class ModeDamping(Effect):
    """-c_d(u_e, u_r) v with c_d bilinear between the four valve modes of Table II."""

    kind: Literal["mode_damping"] = "mode_damping"
    pressures: tuple[Pascal, ...] = TABLE_PRESSURES
    c_extend: tuple[Damping, ...] = (91.0, 97.0, 103.0)
    c_retract: tuple[Damping, ...] = (78.0, 84.0, 89.0)
    c_both: tuple[Damping, ...] = (52.0, 59.0, 64.0)
    c_none: Annotated[float, Param("N.s.m-1", 10.0, lower=0.0, doc="both valves off")] = 25.0

    family: ClassVar[str] = "piston"
    equation: ClassVar[str] = "-c_d(u_e, u_r) v, c_d = c0 + u_e c1 + u_r c2 + u_e u_r c3"
    source: ClassVar[str] = "paper eq. 6, 7, Table II"
    ports: ClassVar[tuple[str, ...]] = ("piston",)
    dissipative: ClassVar[bool] = True
    nominal: ClassVar[dict[str, Tolerance]] = dict.fromkeys(
        ("c_extend", "c_retract", "c_both", "c_none"),
        Tolerance(2.0, "N.s.m-1", source="assumed: 2 to 3 % of Table II, more of the small c_none"),
    )

    def c_d(self, u_e: Any, u_r: Any, supply: float) -> Any:
        """Damping [N.s.m-1] in a valve mode at a supply pressure [Pa] (eq. 6)."""
        extend, retract, both = (
            at_supply(supply, self.pressures, table)
            for table in (self.c_extend, self.c_retract, self.c_both)
        )
        c0, c1, c2 = self.c_none, extend - self.c_none, retract - self.c_none
        c3 = both - extend - retract + self.c_none
        return c0 + u_e * c1 + u_r * c2 + u_e * u_r * c3

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"piston": -self.c_d(at.u_e, at.u_r, at.supply) * at.piston.v})
