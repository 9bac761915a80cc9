"""Mode-dependent damping of the double-acting piston (paper, eq. 6 and 7)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from typing_extensions import Self

from kemba.effects.base import At, Contribution, Effect
from kemba.effects.pneumatics.chamber import Pascal
from kemba.effects.pneumatics.tables import at_supply, beyond, filled
from kemba.quantity import Param, Tolerance

if TYPE_CHECKING:
    from kemba.mechanism import Cylinder

Damping = Annotated[float, Param("N.s.m-1", 10.0, lower=0.0, doc="of Table II")]
NONE = Param("N.s.m-1", 10.0, lower=0.0, doc="both valves off")
MODES = ("c_extend", "c_retract", "c_both")


class ModeDamping(Effect):
    """-c_d(u_e, u_r) v with c_d bilinear between the four valve modes of Table II.

    Other figures are those of the robot's cylinder.
    """

    pressures: tuple[Pascal, ...] | None = None
    c_extend: tuple[Damping, ...] | None = None
    c_retract: tuple[Damping, ...] | None = None
    c_both: tuple[Damping, ...] | None = None
    c_none: Annotated[float | None, NONE] = None

    family = "piston"
    equation = "-c_d(u_e, u_r) v, c_d = c0 + u_e c1 + u_r c2 + u_e u_r c3"
    source = "paper eq. 6, 7, Table II"
    ports = ("piston",)
    publishes = ("F_mode",)
    dissipative = True
    nominal: ClassVar[dict[str, Tolerance]] = dict.fromkeys(
        ("c_extend", "c_retract", "c_both", "c_none"),
        Tolerance(2.0, "N.s.m-1", source="assumed: 2 to 3 % of Table II, more of the small c_none"),
    )

    def of_cylinder(self, cylinder: Cylinder) -> Self:
        return filled(self, cylinder, ("pressures", *MODES, "c_none"), MODES)

    def remarks(self, supply: float) -> list[str]:
        return beyond(self, supply, MODES)

    def c_d(self, u_e: Any, u_r: Any, supply: Any) -> Any:
        """Damping [N.s.m-1] in a valve mode at a supply pressure [Pa] (eq. 6)."""
        extend, retract, both = (at_supply(self, mode, supply) for mode in MODES)
        c0 = self.value("c_none")
        c1, c2, c3 = extend - c0, retract - c0, both - extend - retract + c0
        return c0 + u_e * c1 + u_r * c2 + u_e * u_r * c3

    def evaluate(self, at: At) -> Contribution:
        force = -self.c_d(at.u_e, at.u_r, at.supply) * at.piston.v
        return Contribution(effort={"piston": force}, publish={"F_mode": force})
