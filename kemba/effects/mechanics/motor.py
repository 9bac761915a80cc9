"""Quasi-direct-drive hip motor: torque input within its torque-speed limits."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from kemba.effects.base import At, Contribution, Effect
from kemba.quantity import Param, Quantity


class Motor(Effect):
    """Ideal torque source at the hip; the speed it can drive falls linearly with torque."""

    kind: Literal["motor"] = "motor"
    tau_peak: Annotated[float, Param("N.m", 1.0, lower=0.0, doc="peak torque")] = 24.8
    w_noload: Annotated[float, Param("rad.s-1", 1.0, lower=0.0, doc="no-load speed")] = 49.7
    tau_rated: Annotated[float, Param("N.m", 1.0, lower=0.0, doc="rated torque")] = 8.3
    w_rated: Annotated[float, Param("rad.s-1", 1.0, lower=0.0, doc="speed at rated torque")] = 41.9

    family: ClassVar[str] = "hip"
    equation: ClassVar[str] = "tau, |tau| <= tau_peak, +-w <= w_noload - slope (+-tau)"
    source: ClassVar[str] = "paper II-A (peak, no-load); authors' program (rated point)"
    ports: ClassVar[tuple[str, ...]] = ("hip",)
    mirror: ClassVar[dict[str, str]] = {"tau": "-tau"}

    def inputs(self) -> dict[str, Quantity]:
        peak = self.tau_peak
        return {"tau": Quantity("hip/tau", "N.m", -peak, peak, 10.0, doc="hip torque")}

    def evaluate(self, at: At) -> Contribution:
        slope = (self.w_noload - self.w_rated) / self.tau_rated
        w, tau = at.hip.v, at.tau
        return Contribution(
            effort={"hip": tau},
            limits={
                "speed_forward": (self.w_noload - slope * tau - w) / self.w_noload,
                "speed_backward": (self.w_noload + slope * tau + w) / self.w_noload,
            },
        )
