"""The hip joint and its quasi-direct-drive motor."""

from typing import Annotated, ClassVar

from kemba.effects.base import At, Contribution, Effect, HipEffect, Signal
from kemba.effects.mechanics.laws import coulomb, viscous
from kemba.quantity import Param, Quantity


class Motor(Effect):
    """Ideal torque source at the hip; the speed it can drive falls linearly with torque."""

    tau_peak: Annotated[float, Param("N.m", 1.0, lower=0.0, doc="peak torque")] = 24.8
    w_noload: Annotated[float, Param("rad.s-1", 1.0, lower=0.0, doc="no-load speed")] = 49.7
    tau_rated: Annotated[float, Param("N.m", 1.0, lower=0.0, doc="rated torque")] = 8.3
    w_rated: Annotated[float, Param("rad.s-1", 1.0, lower=0.0, doc="speed at rated torque")] = 41.9

    family = "hip"
    equation = "tau, |tau| <= tau_peak, +-w <= w_noload - slope (+-tau)"
    source = "paper II-A (peak, no-load); authors' program (rated point)"
    ports = ("hip",)
    mirror: ClassVar[dict[str, str]] = {"tau": "-tau"}

    def inputs(self) -> dict[str, Quantity]:
        peak = self.tau_peak
        return {"tau": Quantity("hip/tau", "N.m", -peak, peak, 10.0, doc="hip torque")}

    @property
    def slope(self) -> float:
        """Speed that is lost per torque [rad.s-1/(N.m)]."""
        return (self.w_noload - self.w_rated) / self.tau_rated

    def evaluate(self, at: At) -> Contribution:
        w, tau, slope = at.hip.v, at.tau, self.slope
        return Contribution(
            effort={"hip": tau},
            limits={
                "speed_forward": (self.w_noload - slope * tau - w) / self.w_noload,
                "speed_backward": (self.w_noload + slope * tau + w) / self.w_noload,
            },
        )


W_COULOMB = 0.1  # rad.s-1


class HipFriction(HipEffect):
    """Coulomb friction of gear and bearings."""

    T_c: Annotated[float, Param("N.m", 0.6, lower=0.0, doc="Coulomb torque")] = 0.0

    equation = "-T_c tanh(w/0.1)"
    source = "planetary gear, 10:1"
    dissipative = True

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"hip": coulomb(self.T_c, at.hip.v, W_COULOMB)})


class HipDamping(HipEffect):
    """Viscous loss of gear, grease and motor."""

    b: Annotated[float, Param("N.m.s.rad-1", 0.1, doc="damping")] = 0.0

    equation = "-b w"
    source = "planetary gear, 10:1"
    dissipative = True

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"hip": viscous(self.b, at.hip.v)})


class TorqueScale(HipEffect):
    """The motor's torque constant differs from the one the command assumes."""

    k: Annotated[float, Param("1", 0.1, lower=0.0, doc="torque per command, nominal 1")] = 1.0

    equation = "tau -> k tau"
    source = "torque constants are given to about 10 %"

    def signals(self, at: At) -> dict[str, Signal]:
        return {"tau": Signal(gain=self.k)}


class MotorLag(HipEffect):
    """Current control follows the (scaled) command with a lag.

    T = 0.1 ms, the smallest allowed, is as good as no lag.
    """

    T: Annotated[float, Param("s", 0.005, lower=1e-4, doc="time constant")] = 1e-4

    equation = "T dtau_a/dt = tau - tau_a, tau_a acts on the joint"
    source = "bandwidth of the motor's current loop and bus"
    mirror: ClassVar[dict[str, str]] = {"tau_a": "-tau_a"}

    def states(self) -> dict[str, Quantity]:
        return {"tau_a": Quantity("hip/tau_a", "N.m", -50, 50, 10.0, doc="torque at the joint")}

    def signals(self, at: At) -> dict[str, Signal]:
        return {"tau": Signal(lagged=at.tau_a)}

    def evaluate(self, at: At) -> Contribution:
        return Contribution(rate={"tau_a": (at.source("tau") - at.tau_a) / self.T})


class HipSpring(HipEffect):
    """A spring that pulls the hip towards q0: cables and hoses. q0 unless given: standing."""

    k: Annotated[float, Param("N.m.rad-1", 1.5, lower=0.0, doc="stiffness")] = 0.0
    q0: Annotated[float, Param("rad", doc="angle at rest")] | None = None

    equation = "-k (q - q0)"
    source = "stiffness of cables and hoses across the joint"

    def evaluate(self, at: At) -> Contribution:
        q0 = at.standing("hip/q") if self.q0 is None else self.q0
        return Contribution(effort={"hip": -self.k * (at.hip.x - q0)})


class RotorInertia(HipEffect):
    """Inertia of rotor and gear seen at the joint, beside the one in the robot's link table."""

    J: Annotated[float, Param("kg.m2", 0.01, lower=0.0, doc="inertia at the joint")] = 0.0

    equation = "-J dw/dt"
    source = "rotor inertia times the gear ratio squared"

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"hip": -self.J * at.hip.a})
