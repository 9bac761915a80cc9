"""First-order chambers and damping by valve mode (paper, eq. 4 to 7), and figures over the supply
pressure: the cylinder's where an effect does not give them, interpolated between the pressures
measured, extrapolated beyond them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, TypeVar

import casadi as ca
import numpy as np
from typing_extensions import Self

from kemba.effects.base import At, Contribution, Effect
from kemba.effects.pneumatics.flow import ATMOSPHERE
from kemba.errors import KembaError
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


def pressure(side: str) -> Quantity:
    """The pressure of a chamber."""
    sizes = 1e4, 3e6, 2e5, ATMOSPHERE
    return Quantity(f"chamber/{side}/P", "Pa", *sizes, f"{side}, absolute")


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
        x, cylinder = at.piston.x, at.cylinder
        sides = {
            "extend": ("e", cylinder.area_extend, x, at.u_e, at.F_e),
            "retract": ("r", cylinder.area_retract, at.stroke - x, at.u_r, at.F_r),
        }
        rate, publish, outputs = {}, dict[str, Any](), []
        for side, (c, A, way, u, F) in sides.items():
            tau = at.rise_gain * self.rise_time(u, way, at.stroke)
            static = at.supply_gain * at_supply(self, f"F_{side}", at.supply)
            rate[f"F_{c}"] = (at.droop * static * u - F) / tau
            publish |= {f"F_static_{c}": static, f"tau_{c}": tau}
            outputs.append((pressure(side), ATMOSPHERE + F / A))
        return Contribution({"piston": at.F_e - at.F_r}, rate, publish=publish, outputs=outputs)


E = TypeVar("E", bound=Effect)


def filled(effect: E, cylinder: Cylinder, names: Sequence[str], tables: Sequence[str]) -> E:
    """`effect` with those of `names` that are None taken from the cylinder.

    `tables` are those with one entry per entry of `pressures`. Raises KembaError where their
    lengths differ.
    """
    left = {n: getattr(cylinder, n) for n in names if getattr(effect, n) is None}
    found = effect.model_copy(update=left)
    count = len(found.value("pressures"))
    for name in tables:
        if len(found.value(name)) != count:
            what = f"{name} has {len(found.value(name))} entries, pressures {count}"
            expected = "one entry for each supply pressure was expected"
            raise KembaError(f"effects.{effect.name}", what, expected)
    return found


def at_supply(effect: Effect, table: str, supply: Any) -> Any:
    """A table of an effect at a supply pressure [Pa]; entries and pressure may be symbols.

    Piecewise linear; extrapolated from the last two entries beyond the pressures of the table.
    A table of one entry holds at every pressure.
    """
    values, pressures = effect.value(table), np.asarray(effect.value("pressures"))
    if len(pressures) == 1:
        return values[0]
    if isinstance(supply, ca.SX):
        return ca.pw_lin(supply, pressures, ca.vertcat(*values))
    i = int(np.clip(np.searchsorted(pressures, supply) - 1, 0, len(pressures) - 2))
    share = float((supply - pressures[i]) / (pressures[i + 1] - pressures[i]))
    return (1 - share) * values[i] + share * values[i + 1]


def beyond(effect: Effect, supply: float, tables: Sequence[str]) -> list[str]:
    """Remarks on a supply pressure [Pa] outside an effect's tables; nothing inside them. Raises
    KembaError where what is extrapolated is not positive, which is physically impossible."""
    low, high = min(effect.value("pressures")), max(effect.value("pressures"))
    if low <= supply <= high:
        return []
    where, given = f"effects.{effect.name}", f"{supply / 1e6:g} MPa of supply pressure"
    span = f"{low / 1e6:g} to {high / 1e6:g} MPa" if low < high else f"{low / 1e6:g} MPa only"
    found = {name: at_supply(effect, name, supply) for name in tables}
    for name, value in found.items():
        if value <= 0:
            what = f"{given} would make {name} {value:.0f}, which cannot be"
            raise KembaError(where, what, f"the tables hold for {span}")
    values = ", ".join(f"{name} {value:.4g}" for name, value in found.items())
    how = "extrapolated linearly" if low < high else "taken as they are"
    return [f"{where}: {given} is outside the measured range ({span}); {how}: {values}"]


Damping = Annotated[float, Param("N.s.m-1", 10.0, lower=0.0, doc="of Table II")]
MODES = ("c_extend", "c_retract", "c_both")


class ModeDamping(Effect):
    """-c_d(u_e, u_r) v with c_d bilinear between the four valve modes of Table II.

    Other figures are those of the robot's cylinder.
    """

    pressures: tuple[Pascal, ...] | None = None
    c_extend: tuple[Damping, ...] | None = None
    c_retract: tuple[Damping, ...] | None = None
    c_both: tuple[Damping, ...] | None = None
    c_none: Annotated[float | None, Param("N.s.m-1", 10.0, lower=0.0, doc="both valves off")] = None

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
