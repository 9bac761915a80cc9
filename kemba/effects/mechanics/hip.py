"""The hip joint and its motor, beyond the ideal torque source."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from kemba.effects.base import At, Contribution, Effect, Signal
from kemba.effects.mechanics.laws import coulomb, viscous
from kemba.quantity import Param, Quantity

W_COULOMB = 0.1  # rad.s-1


class HipFriction(Effect):
    """Coulomb friction of gear and bearings."""

    kind: Literal["hip_friction"] = "hip_friction"
    T_c: Annotated[float, Param("N.m", 0.6, lower=0.0, doc="Coulomb torque")] = 0.0

    family: ClassVar[str] = "hip"
    equation: ClassVar[str] = "-T_c tanh(w/0.1)"
    source: ClassVar[str] = "planetary gear, 10:1"
    ports: ClassVar[tuple[str, ...]] = ("hip",)
    off: ClassVar[dict[str, float]] = {"T_c": 0.0}
    dissipative: ClassVar[bool] = True

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"hip": coulomb(self.T_c, at.hip.v, W_COULOMB)})


class HipDamping(Effect):
    """Viscous loss of gear, grease and motor."""

    kind: Literal["hip_damping"] = "hip_damping"
    b: Annotated[float, Param("N.m.s.rad-1", 0.1, doc="damping")] = 0.0

    family: ClassVar[str] = "hip"
    equation: ClassVar[str] = "-b w"
    source: ClassVar[str] = "planetary gear, 10:1"
    ports: ClassVar[tuple[str, ...]] = ("hip",)
    off: ClassVar[dict[str, float]] = {"b": 0.0}
    dissipative: ClassVar[bool] = True

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"hip": viscous(self.b, at.hip.v)})


class TorqueScale(Effect):
    """The motor's torque constant differs from the one the command assumes."""

    kind: Literal["torque_scale"] = "torque_scale"
    k: Annotated[float, Param("1", 0.1, lower=0.0, doc="torque per command, nominal 1")] = 1.0

    family: ClassVar[str] = "hip"
    equation: ClassVar[str] = "tau -> k tau"
    source: ClassVar[str] = "torque constants are given to about 10 %"
    ports: ClassVar[tuple[str, ...]] = ("hip",)
    off: ClassVar[dict[str, float]] = {"k": 1.0}

    def signals(self, at: At) -> dict[str, Signal]:
        return {"tau": Signal(gain=self.k)}


class MotorLag(Effect):
    """Current control follows the (scaled) command with a lag.

    T = 0.1 ms, the smallest allowed, is as good as no lag.
    """

    kind: Literal["motor_lag"] = "motor_lag"
    T: Annotated[float, Param("s", 0.005, lower=1e-4, doc="time constant")] = 1e-4

    family: ClassVar[str] = "hip"
    equation: ClassVar[str] = "T dtau_a/dt = tau - tau_a, tau_a acts on the joint"
    source: ClassVar[str] = "bandwidth of the motor's current loop and bus"
    ports: ClassVar[tuple[str, ...]] = ("hip",)
    off: ClassVar[dict[str, float]] = {"T": 1e-4}
    mirror: ClassVar[dict[str, str]] = {"tau_a": "-tau_a"}

    def states(self) -> dict[str, Quantity]:
        return {"tau_a": Quantity("hip/tau_a", "N.m", -50, 50, 10.0, doc="torque at the joint")}

    def signals(self, at: At) -> dict[str, Signal]:
        return {"tau": Signal(lagged=at.tau_a)}

    def evaluate(self, at: At) -> Contribution:
        return Contribution(rate={"tau_a": (at.source("tau") - at.tau_a) / self.T})


class HipSpring(Effect):
    """A spring that pulls the hip towards q0: cables and hoses. q0 unless given: standing."""

    kind: Literal["hip_spring"] = "hip_spring"
    k: Annotated[float, Param("N.m.rad-1", 1.5, lower=0.0, doc="stiffness")] = 0.0
    q0: Annotated[float, Param("rad", doc="angle at rest")] | None = None

    family: ClassVar[str] = "hip"
    equation: ClassVar[str] = "-k (q - q0)"
    source: ClassVar[str] = "stiffness of cables and hoses across the joint"
    ports: ClassVar[tuple[str, ...]] = ("hip",)
    off: ClassVar[dict[str, float]] = {"k": 0.0}

    def evaluate(self, at: At) -> Contribution:
        q0 = at.standing("hip/q") if self.q0 is None else self.q0
        return Contribution(effort={"hip": -self.k * (at.hip.x - q0)})


class RotorInertia(Effect):
    """Inertia of rotor and gear seen at the joint, beside the one in the robot's link table."""

    kind: Literal["rotor_inertia"] = "rotor_inertia"
    J: Annotated[float, Param("kg.m2", 0.01, lower=0.0, doc="inertia at the joint")] = 0.0

    family: ClassVar[str] = "hip"
    equation: ClassVar[str] = "-J dw/dt"
    source: ClassVar[str] = "rotor inertia times the gear ratio squared"
    ports: ClassVar[tuple[str, ...]] = ("hip",)
    off: ClassVar[dict[str, float]] = {"J": 0.0}

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"hip": -self.J * at.hip.a})
