"""Along the piston: end stops, friction of the seals, dampers and springs."""

from typing import Annotated, Any

import casadi as ca

from kemba.effects.base import At, Contribution, Effect, Pair, PistonEffect
from kemba.effects.mechanics.laws import fading
from kemba.quantity import Param, Quantity


class EndStop(Effect):
    """The piston stays within its stroke; the stop pushes only when touched."""

    family = "piston"
    equation = "0 <= x _|_ lam_in >= 0, 0 <= stroke - x _|_ lam_out >= 0"
    source = "paper IV-A.1"
    ports = ("piston",)
    on_rod = False

    def forces(self) -> dict[str, Quantity]:
        top = 20000.0
        return {
            "lam_in": Quantity("piston/stop_in", "N", 0.0, top, 100.0, doc="stop at x = 0"),
            "lam_out": Quantity("piston/stop_out", "N", 0.0, top, 100.0, doc="stop at full stroke"),
        }

    def evaluate(self, at: At) -> Contribution:
        return Contribution(
            effort={"piston": at.lam_in - at.lam_out},
            pairs=(
                Pair("retracted", at.piston.x, at.lam_in),
                Pair("extended", at.stroke - at.piston.x, at.lam_out),
            ),
        )


V_COULOMB = 0.01  # m.s-1; below it the sign of v is smoothed


class SealFriction(PistonEffect):
    """Coulomb friction of the piston's seals."""

    F_c: Annotated[float, Param("N", 10.0, lower=0.0, doc="Coulomb force")] = 0.0

    equation = "-F_c tanh(v/0.01)"
    source = "paper Table II: 6-8 N are missing at every pressure, both valves on"
    dissipative = True

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"piston": -self.F_c * at.sense})


class StribeckFriction(PistonEffect):
    """Extra friction near standstill that fades as the seal's lubricating film builds up."""

    F_s: Annotated[float, Param("N", 10.0, lower=0.0, doc="extra force near standstill")] = 0.0
    v_b: Annotated[float, Param("m.s-1", 0.05, lower=1e-3, doc="rate at which it fades")] = 0.05

    equation = "-F_s exp(-(v/v_b)^2) tanh(v/0.01)"
    source = "Stribeck curve of lubricated rubber seals"
    dissipative = True

    def evaluate(self, at: At) -> Contribution:
        force = self.F_s * fading(at.piston.v, self.v_b)
        return Contribution(effort={"piston": -force * at.sense})


class PressureFriction(PistonEffect):
    """Friction of lip seals, which the air presses against bore and rod."""

    mu: Annotated[float, Param("1", 0.04, lower=0.0, doc="friction per chamber force")] = 0.0

    equation = "-mu (F_e + F_r) tanh(v/0.01)"
    source = "lip seals: contact force proportional to pressure"
    dissipative = True

    def evaluate(self, at: At) -> Contribution:
        load = self.mu * (at.F_e + at.F_r)
        return Contribution(effort={"piston": -load * at.sense})


class DirectionFriction(PistonEffect):
    """Seals whose lips hold harder one way: more friction when extending by F_d, less by F_d when
    retracting. While the piston moves, it looks like a force sensor whose zero is off."""

    F_d: Annotated[float, Param("N", 3.0, doc="half the difference, extending less retracting")] = (
        0.0
    )

    equation = "-F_d tanh(v/0.01)^2"
    source = (
        "asymmetric lips of seals and wipers: H. K. Mueller, B. S. Nau, Fluid Sealing Technology"
    )
    own_rigs = True

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"piston": -self.F_d * at.sense**2})


class PistonDamping(PistonEffect):
    """Viscous damping beside, or with c < 0 taken off, that of Table II."""

    c: Annotated[float, Param("N.s.m-1", 15.0, doc="damping")] = 0.0

    equation = "-c v"
    source = "paper eq. 6, Table II (c_d from one pair of cylinders)"
    dissipative = True

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"piston": -self.c * at.piston.v})


class QuadraticDamping(PistonEffect):
    """Turbulent loss of the air that the piston moves: the force-velocity line bends."""

    c: Annotated[float, Param("N.s2.m-2", 40.0, doc="quadratic damping")] = 0.0

    equation = "-c v abs(v)"
    source = "turbulent flow through ports; paper Fig. 6 is almost, not quite, linear"
    dissipative = True

    def evaluate(self, at: At) -> Contribution:
        v = at.piston.v
        return Contribution(effort={"piston": -self.c * v * ca.fabs(v)})


class EndCushion(PistonEffect):
    """Damping that grows towards the end the piston moves to, within L of it."""

    c: Annotated[float, Param("N.s.m-1", 300.0, lower=0.0, doc="damping at the very end")] = 0.0
    L: Annotated[float, Param("m", 0.010, lower=1e-4, doc="length of the cushion")] = 0.010

    equation = "-c (1 - d/L) v while moving towards an end at distance d < L"
    source = "data sheet DSNU-25-70-PPS-A: self-adjusting end-position cushioning"
    dissipative = True

    def closing(self, d: Any) -> Any:
        """1 at the end, falling to 0 at the distance L from it."""
        return ca.fmin(1, ca.fmax(0, 1 - d / self.L))

    def evaluate(self, at: At) -> Contribution:
        x, v = at.piston.x, at.piston.v
        outwards = self.closing(at.stroke - x) * ca.fmax(v, 0)
        inwards = self.closing(x) * ca.fmin(v, 0)
        return Contribution(effort={"piston": -self.c * (outwards + inwards)})


class GasSpring(PistonEffect):
    """A spring about mid-stroke: trapped air, or a rod that is pulled."""

    k: Annotated[float, Param("N.m-1", 400.0, lower=0.0, doc="stiffness")] = 0.0

    equation = "-k (x - 0.035)"
    source = "air trapped on either side of the piston, linearised at mid-stroke"

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"piston": -self.k * (at.piston.x - at.stroke / 2)})
