"""What the boom and its bearings do to the body beyond inertia and weight."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from kemba.effects.base import At, Contribution, Effect
from kemba.effects.mechanics.laws import direction
from kemba.quantity import Param

V_BOOM = 0.02  # m.s-1
W_PITCH = 0.05  # rad.s-1


class BoomForce(Effect):
    """A constant vertical force: wrong boom weight, counterweight, catch rope. Up positive."""

    kind: Literal["boom_force"] = "boom_force"
    F: Annotated[float, Param("N", 4.0, doc="force, upwards positive")] = 0.0

    place: ClassVar[Literal["leg", "body"]] = "body"
    family: ClassVar[str] = "boom"
    equation: ClassVar[str] = "+F on z"
    source: ClassVar[str] = "paper Fig. 2, 11: tensioned cables, catch rope"
    ports: ClassVar[tuple[str, ...]] = ("body_z",)
    off: ClassVar[dict[str, float]] = {"F": 0.0}

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"body_z": self.F})


class BoomInertia(Effect):
    """Mass without weight: the boom has more inertia than the model says."""

    kind: Literal["boom_inertia"] = "boom_inertia"
    m: Annotated[float, Param("kg", 0.2, lower=0.0, doc="mass without weight")] = 0.0

    place: ClassVar[Literal["leg", "body"]] = "body"
    family: ClassVar[str] = "boom"
    equation: ClassVar[str] = "-m ax on x, -m az on z"
    source: ClassVar[str] = "paper II-B: 4.82 kg.m2 about the central pivot"
    ports: ClassVar[tuple[str, ...]] = ("body_x", "body_z")
    off: ClassVar[dict[str, float]] = {"m": 0.0}

    def evaluate(self, at: At) -> Contribution:
        return Contribution(
            effort={"body_x": -self.m * at.body_x.a, "body_z": -self.m * at.body_z.a}
        )


class BoomFriction(Effect):
    """Coulomb friction of the boom's bearings, felt at the body."""

    kind: Literal["boom_friction"] = "boom_friction"
    F: Annotated[float, Param("N", 2.0, lower=0.0, doc="Coulomb force at the body")] = 0.0

    place: ClassVar[Literal["leg", "body"]] = "body"
    family: ClassVar[str] = "boom"
    equation: ClassVar[str] = "-F tanh(vx/0.02) on x, -F tanh(vz/0.02) on z"
    source: ClassVar[str] = "bearings and cables of the boom"
    ports: ClassVar[tuple[str, ...]] = ("body_x", "body_z")
    off: ClassVar[dict[str, float]] = {"F": 0.0}
    dissipative: ClassVar[bool] = True

    def evaluate(self, at: At) -> Contribution:
        return Contribution(
            effort={
                "body_x": -self.F * direction(at.body_x.v, V_BOOM),
                "body_z": -self.F * direction(at.body_z.v, V_BOOM),
            }
        )


class BoomDamping(Effect):
    """Viscous loss of the boom's bearings and drag of the boom, felt at the body."""

    kind: Literal["boom_damping"] = "boom_damping"
    b: Annotated[float, Param("N.s.m-1", 2.0, doc="damping at the body")] = 0.0

    place: ClassVar[Literal["leg", "body"]] = "body"
    family: ClassVar[str] = "boom"
    equation: ClassVar[str] = "-b vx on x, -b vz on z"
    source: ClassVar[str] = "bearings and cables of the boom"
    ports: ClassVar[tuple[str, ...]] = ("body_x", "body_z")
    off: ClassVar[dict[str, float]] = {"b": 0.0}
    dissipative: ClassVar[bool] = True

    def evaluate(self, at: At) -> Contribution:
        return Contribution(
            effort={"body_x": -self.b * at.body_x.v, "body_z": -self.b * at.body_z.v}
        )


class BoomSpring(Effect):
    """A vertical spring on the body: tensioned cables. z0 unless given: standing height."""

    kind: Literal["boom_spring"] = "boom_spring"
    k: Annotated[float, Param("N.m-1", 15.0, lower=0.0, doc="stiffness")] = 0.0
    z0: Annotated[float, Param("m", doc="height at rest")] | None = None

    place: ClassVar[Literal["leg", "body"]] = "body"
    family: ClassVar[str] = "boom"
    equation: ClassVar[str] = "-k (z - z0)"
    source: ClassVar[str] = "paper Fig. 2: tensioned cables"
    ports: ClassVar[tuple[str, ...]] = ("body_z",)
    off: ClassVar[dict[str, float]] = {"k": 0.0}

    def evaluate(self, at: At) -> Contribution:
        z0 = at.standing("body/z") if self.z0 is None else self.z0
        return Contribution(effort={"body_z": -self.k * (at.body_z.x - z0)})


class PitchFriction(Effect):
    """Coulomb friction of the pitch bearing at the boom's end."""

    kind: Literal["pitch_friction"] = "pitch_friction"
    T: Annotated[float, Param("N.m", 0.3, lower=0.0, doc="Coulomb torque")] = 0.0

    place: ClassVar[Literal["leg", "body"]] = "body"
    family: ClassVar[str] = "boom"
    equation: ClassVar[str] = "-T tanh(pitch'/0.05)"
    source: ClassVar[str] = "bearing at the boom's end"
    ports: ClassVar[tuple[str, ...]] = ("pitch",)
    off: ClassVar[dict[str, float]] = {"T": 0.0}
    dissipative: ClassVar[bool] = True

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"pitch": -self.T * direction(at.pitch.v, W_PITCH)})
