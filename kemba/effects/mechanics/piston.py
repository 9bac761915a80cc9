"""Dampers and springs along the piston."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

import casadi as ca

from kemba.effects.base import At, Contribution, Effect
from kemba.quantity import Param


class PistonDamping(Effect):
    """Viscous damping beside, or with c < 0 taken off, that of Table II."""

    kind: Literal["piston_damping"] = "piston_damping"
    c: Annotated[float, Param("N.s.m-1", 15.0, doc="damping")] = 0.0

    family: ClassVar[str] = "piston"
    equation: ClassVar[str] = "-c v"
    source: ClassVar[str] = "paper eq. 6, Table II (c_d from one pair of cylinders)"
    ports: ClassVar[tuple[str, ...]] = ("piston",)
    off: ClassVar[dict[str, float]] = {"c": 0.0}
    dissipative: ClassVar[bool] = True

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"piston": -self.c * at.piston.v})


class QuadraticDamping(Effect):
    """Turbulent loss of the air that the piston moves: the force-velocity line bends."""

    kind: Literal["quadratic_damping"] = "quadratic_damping"
    c: Annotated[float, Param("N.s2.m-2", 40.0, doc="quadratic damping")] = 0.0

    family: ClassVar[str] = "piston"
    equation: ClassVar[str] = "-c v abs(v)"
    source: ClassVar[str] = (
        "turbulent flow through ports; paper Fig. 6 is almost, not quite, linear"
    )
    ports: ClassVar[tuple[str, ...]] = ("piston",)
    off: ClassVar[dict[str, float]] = {"c": 0.0}
    dissipative: ClassVar[bool] = True

    def evaluate(self, at: At) -> Contribution:
        v = at.piston.v
        return Contribution(effort={"piston": -self.c * v * ca.fabs(v)})


class EndCushion(Effect):
    """Damping that grows towards the end the piston moves to, within L of it."""

    kind: Literal["end_cushion"] = "end_cushion"
    c: Annotated[float, Param("N.s.m-1", 300.0, lower=0.0, doc="damping at the very end")] = 0.0
    L: Annotated[float, Param("m", 0.010, lower=1e-4, doc="length of the cushion")] = 0.010

    family: ClassVar[str] = "piston"
    equation: ClassVar[str] = "-c (1 - d/L) v while moving towards an end at distance d < L"
    source: ClassVar[str] = "data sheet DSNU-25-70-PPS-A: self-adjusting end-position cushioning"
    ports: ClassVar[tuple[str, ...]] = ("piston",)
    off: ClassVar[dict[str, float]] = {"c": 0.0}
    dissipative: ClassVar[bool] = True

    def closing(self, d: Any) -> Any:
        """1 at the end, falling to 0 at the distance L from it."""
        return ca.fmin(1, ca.fmax(0, 1 - d / self.L))

    def evaluate(self, at: At) -> Contribution:
        x, v = at.piston.x, at.piston.v
        outwards = self.closing(at.stroke - x) * ca.fmax(v, 0)
        inwards = self.closing(x) * ca.fmin(v, 0)
        return Contribution(effort={"piston": -self.c * (outwards + inwards)})


class GasSpring(Effect):
    """A spring about mid-stroke: trapped air, or a rod that is pulled."""

    kind: Literal["gas_spring"] = "gas_spring"
    k: Annotated[float, Param("N.m-1", 400.0, lower=0.0, doc="stiffness")] = 0.0

    family: ClassVar[str] = "piston"
    equation: ClassVar[str] = "-k (x - 0.035)"
    source: ClassVar[str] = "air trapped on either side of the piston, linearised at mid-stroke"
    ports: ClassVar[tuple[str, ...]] = ("piston",)
    off: ClassVar[dict[str, float]] = {"k": 0.0}

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"piston": -self.k * (at.piston.x - at.stroke / 2)})
