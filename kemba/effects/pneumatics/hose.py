"""What happens to the air between valve, hose and chamber."""

from typing import Annotated

from kemba.effects.base import AirEffect, At, Contribution, Signal
from kemba.quantity import Param, Quantity


class HoseLag(AirEffect):
    """The hose between valve and chamber: every use of u sees it filtered.

    T = 0.1 ms, the smallest allowed, is as good as no hose.
    """

    T: Annotated[float, Param("s", 0.004, lower=1e-4, doc="time constant")] = 1e-4

    equation = "T du_f/dt = u - u_f, u -> u_f wherever u is read"
    source = "line dynamics of pneumatic tubing, lumped to first order"

    def states(self) -> dict[str, Quantity]:
        return {
            "u_f_e": Quantity("hose/extend/u", "1", 0.0, 1.0, 1.0, doc="valve after the hose"),
            "u_f_r": Quantity("hose/retract/u", "1", 0.0, 1.0, 1.0, doc="valve after the hose"),
        }

    def signals(self, at: At) -> dict[str, Signal]:
        return {"u_e": Signal(lagged=at.u_f_e), "u_r": Signal(lagged=at.u_f_r)}

    def evaluate(self, at: At) -> Contribution:
        return Contribution(
            rate={
                "u_f_e": (at.source("u_e") - at.u_f_e) / self.T,
                "u_f_r": (at.source("u_r") - at.u_f_r) / self.T,
            }
        )


class CrossLeak(AirEffect):
    """Air creeps past the piston's seal from the fuller chamber into the other.

    p is the pressure difference extend - retract.
    """

    k: Annotated[float, Param("s-1", 3.0, lower=0.0, doc="pressure rate per difference")] = 0.0

    equation = "p = F_e/A_e - F_r/A_r; dF_e/dt -= k p A_e, dF_r/dt += k p A_r"
    source = "leak past a worn piston seal; areas from bore and rod"

    def evaluate(self, at: At) -> Contribution:
        A_e, A_r = at.cylinder.area_extend, at.cylinder.area_retract
        p = at.F_e / A_e - at.F_r / A_r
        return Contribution(add_rate={"F_e": -self.k * p * A_e, "F_r": self.k * p * A_r})


class BothModeLoss(AirEffect):
    """Force that is missing (F < 0: in excess) while both valves are on."""

    F: Annotated[float, Param("N", 15.0, doc="force lost with both valves on")] = 0.0

    equation = "-F u_e u_r"
    source = "paper Table II: 50 N with both valves on, where eq. 7 gives 64 N"

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"piston": -self.F * at.u_e * at.u_r})
