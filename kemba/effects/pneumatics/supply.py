"""The air that reaches the chambers: its pressure, its droop, its flow rate."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

import casadi as ca

from kemba.effects.base import At, Contribution, Effect, Signal
from kemba.quantity import Param, Quantity


class SupplyScale(Effect):
    """The supply is stronger or weaker than the tables': both chambers' steady forces scale."""

    kind: Literal["supply_scale"] = "supply_scale"
    k: Annotated[float, Param("1", 0.1, lower=0.0, doc="scale of F_static, nominal 1")] = 1.0

    family: ClassVar[str] = "air"
    equation: ClassVar[str] = "F_static -> k F_static, both chambers"
    source: ClassVar[str] = "paper II-A (0.7 +- 0.1 MPa), Table II"
    ports: ClassVar[tuple[str, ...]] = ("piston",)
    off: ClassVar[dict[str, float]] = {"k": 1.0}

    def signals(self, at: At) -> dict[str, Signal]:
        return {"supply_gain": Signal(gain=self.k)}


class SupplyDroop(Effect):
    """One shared supply that every filling chamber draws down and the tank restores.

    s is the supply's level, 1 when rested.
    """

    kind: Literal["supply_droop"] = "supply_droop"
    D: Annotated[float, Param("1", 0.05, lower=0.0, doc="drop per filled chamber")] = 0.0
    T: Annotated[float, Param("s", 0.3, lower=1e-3, doc="recovery time")] = 0.3

    place: ClassVar[Literal["leg", "body"]] = "body"
    family: ClassVar[str] = "air"
    equation: ClassVar[str] = (
        "ds/dt = (1 - s)/T - D sum_c u_c max(0, s - F_c/F_static,c)/tau_c; F_static -> s F_static"
    )
    source: ClassVar[str] = "paper Table II: the shortfall below pressure x area grows with flow"
    off: ClassVar[dict[str, float]] = {"D": 0.0}

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


class RiseTimeScale(Effect):
    """Chambers fill and vent slower (k > 1) or faster than Table I."""

    kind: Literal["rise_time_scale"] = "rise_time_scale"
    k: Annotated[float, Param("1", 0.25, lower=0.05, doc="scale of tau, nominal 1")] = 1.0

    family: ClassVar[str] = "air"
    equation: ClassVar[str] = "tau_c -> k tau_c"
    source: ClassVar[str] = "paper eq. 4, 5, Table I: other valves or tubing than the authors'"
    ports: ClassVar[tuple[str, ...]] = ("piston",)
    off: ClassVar[dict[str, float]] = {"k": 1.0}

    def signals(self, at: At) -> dict[str, Signal]:
        return {"rise_gain": Signal(gain=self.k)}
