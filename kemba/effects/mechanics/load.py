"""Mass carried by, or misplaced on, the body."""

from collections.abc import Mapping
from typing import Annotated, Any

import casadi as ca

from kemba.effects.base import At, BodyEffect, Contribution
from kemba.quantity import Param


class Payload(BodyEffect):
    """A point mass at the body's centre: inertia and weight."""

    m: Annotated[float, Param("kg", 0.3, lower=0.0, doc="mass")] = 0.0

    equation = "-m ax on x, -m (az + g) on z"
    source = "point mass"

    def evaluate(self, at: At) -> Contribution:
        return Contribution(
            effort={"body_x": -self.m * at.body_x.a, "body_z": -self.m * (at.body_z.a + at.gravity)}
        )


class ComOffset(BodyEffect):
    """The body link's mass M sits d forward of the body's centre.

    Its d'Alembert and weight forces at the offset point, less those at the centre, where the
    link table has them.
    """

    d: Annotated[float, Param("m", 0.02, doc="forward offset along the body")] = 0.0

    equation = "M at (d cos pitch, d sin pitch) from the body's centre, not at it"
    source = "rigid-body kinematics; M = 2.886 kg (authors' program)"
    ports = ("body_x", "body_z", "pitch")

    def evaluate(self, at: At) -> Contribution:
        M, spin, turn = at.body_mass, at.pitch.v**2, at.pitch.a
        along, up = self.d * ca.cos(at.pitch.x), self.d * ca.sin(at.pitch.x)
        # acceleration of the point against that of the centre
        ax, az = -up * turn - along * spin, along * turn - up * spin
        F_x = -M * (at.body_x.a + ax)
        F_z = -M * (at.body_z.a + az + at.gravity)
        return Contribution(
            effort={"body_x": -M * ax, "body_z": -M * az, "pitch": along * F_z - up * F_x}
        )


class MassSplit(BodyEffect):
    """Mass that is in the legs and not in the body: the robot weighs what its file says.

    m leaves the body and is spread over the links of all legs as these are heavy. Every link keeps
    its shape and its centre of mass; its moment of inertia grows with its mass.
    """

    m: Annotated[float, Param("kg", 0.2, doc="mass in the legs instead of the body")] = 0.0

    equation = "M -> M - m, each link of a leg -> (1 + m / all of them) times it"
    source = "link table: weighed as a whole, split by CAD"
    ports = ("body_x", "body_z", "pitch")

    @property
    def geometry(self) -> Mapping[str, Any]:
        return {"legs/mass": self.m}
