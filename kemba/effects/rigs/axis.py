"""What every drive is: a motor that pushes an inertia, and what hangs on it."""

from typing import Annotated, ClassVar

import casadi as ca

from kemba.effects.base import At, AxisEffect, Contribution, Effect
from kemba.effects.mechanics.hip import MotorLag, TorqueScale
from kemba.quantity import Param, Quantity, Tolerance

PLATE = Tolerance(0.05, source="assumed: an inertia from data sheets and drawings, 5 %")


class DriveAxis(Effect):
    """Motor, inertia and load of a drive; the rig brings it along. `J`: inertia of all that moves
    but the load. `m` hangs at `arm`, straight below the axis at q = 0, or is lifted."""

    J: Annotated[float, Param("kg", 1.0, lower=0.0, doc="inertia", rotary="kg.m2")] = 1.0
    m: Annotated[float, Param("kg", 1.0, lower=0.0, doc="mass of the load")] = 1.0
    arm: Annotated[float, Param("m", 0.1, lower=0.0, doc="its arm where it hangs")] = 0.1
    hangs: bool = True

    family = "drive"
    equation = "tau - J a; lifted: - m (a + 9.81); hanging: - m arm (arm a + 9.81 sin q)"
    source = "rigid bodies"
    ports = ("axis",)
    publishes = ("carried",)
    mirror: ClassVar[dict[str, str]] = {"tau": "-tau"}

    @property
    def inertia(self) -> float:
        """Of all that moves [kg or kg.m2]."""
        return self.J + self.m * (self.arm**2 if self.hangs else 1.0)

    def tolerances(self) -> dict[str, float]:
        return {n: PLATE.share(1.0) for n in ("J", "m") if getattr(self, n)}

    def inputs(self) -> dict[str, Quantity]:
        return {"tau": Quantity("axis/tau", "N", scale=10.0, doc="force or torque of the motor")}

    def evaluate(self, at: At) -> Contribution:
        q, a = at.axis.x, at.axis.a
        turning = self.arm * (self.arm * a + at.gravity * ca.sin(q))
        load = self.m * (turning if self.hangs else a + at.gravity)
        carried = self.J * a + load
        return Contribution(effort={"axis": at.tau - carried}, publish={"carried": carried})


class Cogging(AxisEffect):
    """Force that repeats with the position: magnets against slots, a screw that is not true."""

    F_g: Annotated[float, Param("N", 3.0, doc="amplitude", rotary="N.m")] = 0.0
    period: Annotated[
        float, Param("m", 0.01, lower=1e-6, doc="travel of one period", rotary="rad")
    ] = 0.02
    phase: Annotated[float, Param("1", 1.0, lower=1e-3, upper=6.29, doc="angle at q = 0")] = 1.0

    equation = "F_g sin(2 pi q/period + phase)"
    source = "J. R. Hendershot, T. J. E. Miller, Design of Brushless Permanent-Magnet Motors"

    def evaluate(self, at: At) -> Contribution:
        angle = 2 * ca.pi * at.axis.x / self.period + self.phase
        return Contribution(effort={"axis": self.F_g * ca.sin(angle)})


class AxisOffset(AxisEffect):
    """A constant force or torque: a zero that is off, a slope, a drift of the amplifier."""

    F_0: Annotated[float, Param("N", 5.0, doc="force", rotary="N.m")] = 0.0

    equation = "F_0"
    source = "A. Janot, M. Gautier, M. Brunot, EMPS benchmark, 2019 (offset of the drive chain)"

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"axis": self.F_0})


class AxisScale(AxisEffect, TorqueScale):
    """The motor's force or torque constant differs from the one that the log assumes."""


class AxisLag(AxisEffect, MotorLag):
    """The motor follows the (scaled) command with a lag; 0.1 ms is as good as none."""

    def states(self) -> dict[str, Quantity]:
        return {"tau_a": Quantity("axis/tau_a", "N", -1e6, 1e6, 10.0, doc="what acts on the axis")}


class ExtraInertia(AxisEffect):
    """Inertia that the rig's figure leaves out: rotor, gear, screw."""

    J: Annotated[float, Param("kg", 1.0, doc="inertia at the axis", rotary="kg.m2")] = 0.0

    equation = "-J a"
    source = "rotor inertia times the gear ratio squared"

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"axis": -self.J * at.axis.a})
