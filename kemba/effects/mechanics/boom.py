"""The support boom as the body feels it: inertia, weight, bearings, and errors of its lever."""

from collections.abc import Iterable
from typing import Annotated, ClassVar

from kemba.effects.base import At, BoomEffect, Contribution, Effect
from kemba.effects.mechanics.laws import coulomb, viscous
from kemba.effects.sensors import SensorEffect, SensorScale
from kemba.quantity import Param, Tolerance


class Boom(Effect):
    """Boom about its pivot, for small angles: I/l^2 on each axis and its weight's share.

    The lever differs between axes because the body hangs below the boom's end.
    """

    inertia: Annotated[float, Param("kg.m2", 0.1, lower=0.0, doc="about the pivot")] = 4.82
    mass: Annotated[float, Param("kg", 0.1, lower=0.0, doc="mass")] = 2.699
    com: Annotated[float, Param("m", 0.05, lower=0.0, doc="COM from the pivot")] = 1.149
    length_x: Annotated[float, Param("m", 0.05, lower=0.0, doc="lever, horizontal")] = 2.575
    length_z: Annotated[float, Param("m", 0.05, lower=0.0, doc="lever, vertical")] = 2.493

    place = "body"
    family = "boom"
    equation = "-(I/l_x^2) ax on x; -(I/l_z^2) az - m g com/l_z on z"
    source = "paper II-B (mass, inertia); authors' program (lengths, COM)"
    ports = ("body_x", "body_z")
    publishes = ("boom_mass_x", "boom_mass_z", "boom_weight")
    nominal: ClassVar[dict[str, Tolerance]] = dict.fromkeys(
        ("inertia", "mass"), Tolerance(0.02, source="assumed: as its links, weighed or from CAD")
    )

    def evaluate(self, at: At) -> Contribution:
        weight = self.mass * at.gravity * self.com / self.length_z
        mass_x, mass_z = self.inertia / self.length_x**2, self.inertia / self.length_z**2
        return Contribution(
            effort={"body_x": -mass_x * at.body_x.a, "body_z": -mass_z * at.body_z.a - weight},
            publish={"boom_mass_x": mass_x, "boom_mass_z": mass_z, "boom_weight": weight},
        )


class BoomLever(BoomEffect):
    """Both levers of the boom are off by the share k, and so is what its encoders tell.

    Place and height of the body are the boom's angles times the drawn lever: a boom that is 2 %
    longer shows every way of the body 2 % too short. Its inertia and weight act at the true lever.
    """

    k: Annotated[float, Param("1", 0.02, lower=-0.2, upper=0.2, doc="true lever / drawn - 1")] = 0.0

    equation = "l -> (1 + k) l in the boom's inertia and weight; measured x, z = true / (1 + k)"
    source = "lever arithmetic; paper II-B: x and z from the boom's encoders"
    needs = ("boom_mass_x", "boom_mass_z", "boom_weight")

    def readings(self) -> Iterable[SensorEffect]:
        shown = 1.0 / (1.0 + self.k) - 1.0
        return [SensorScale(channel=channel, k=shown) for channel in ("body/x", "body/z")]

    def evaluate(self, at: At) -> Contribution:
        less = 1 / (1 + self.k)
        inertia, weight = less**2 - 1, less - 1
        return Contribution(
            effort={
                "body_x": -inertia * at.boom_mass_x * at.body_x.a,
                "body_z": -inertia * at.boom_mass_z * at.body_z.a - weight * at.boom_weight,
            }
        )


V_BOOM = 0.02  # m.s-1
W_PITCH = 0.05  # rad.s-1


class BoomForce(BoomEffect):
    """A constant vertical force: wrong boom weight, counterweight, catch rope. Up positive."""

    F: Annotated[float, Param("N", 4.0, doc="force, upwards positive")] = 0.0

    equation = "+F on z"
    source = "paper Fig. 2, 11: tensioned cables, catch rope"
    ports = ("body_z",)

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"body_z": self.F})


class BoomInertia(BoomEffect):
    """Mass without weight: the boom has more inertia than the model says."""

    m: Annotated[float, Param("kg", 0.2, lower=0.0, doc="mass without weight")] = 0.0

    equation = "-m ax on x, -m az on z"
    source = "paper II-B: 4.82 kg.m2 about the central pivot"

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={p: -self.m * getattr(at, p).a for p in self.ports})


class BoomFriction(BoomEffect):
    """Coulomb friction of the boom's bearings, felt at the body."""

    F: Annotated[float, Param("N", 2.0, lower=0.0, doc="Coulomb force at the body")] = 0.0

    equation = "-F tanh(vx/0.02) on x, -F tanh(vz/0.02) on z"
    source = "bearings and cables of the boom"
    dissipative = True

    def evaluate(self, at: At) -> Contribution:
        force = {port: coulomb(self.F, getattr(at, port).v, V_BOOM) for port in self.ports}
        return Contribution(effort=force)


class BoomDamping(BoomEffect):
    """Viscous loss of the boom's bearings and drag of the boom, felt at the body."""

    b: Annotated[float, Param("N.s.m-1", 2.0, doc="damping at the body")] = 0.0

    equation = "-b vx on x, -b vz on z"
    source = "bearings and cables of the boom"
    dissipative = True

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={p: viscous(self.b, getattr(at, p).v) for p in self.ports})


class BoomSpring(BoomEffect):
    """A vertical spring on the body: tensioned cables. z0 unless given: standing height."""

    k: Annotated[float, Param("N.m-1", 15.0, lower=0.0, doc="stiffness")] = 0.0
    z0: Annotated[float, Param("m", doc="height at rest")] | None = None

    equation = "-k (z - z0)"
    source = "paper Fig. 2: tensioned cables"
    ports = ("body_z",)

    def evaluate(self, at: At) -> Contribution:
        z0 = at.standing("body/z") if self.z0 is None else self.z0
        return Contribution(effort={"body_z": -self.k * (at.body_z.x - z0)})


class PitchFriction(BoomEffect):
    """Coulomb friction of the pitch bearing at the boom's end."""

    T: Annotated[float, Param("N.m", 0.3, lower=0.0, doc="Coulomb torque")] = 0.0

    equation = "-T tanh(pitch'/0.05)"
    source = "bearing at the boom's end"
    ports = ("pitch",)
    dissipative = True

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"pitch": coulomb(self.T, at.pitch.v, W_PITCH)})
