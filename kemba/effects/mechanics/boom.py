"""The support boom as the body feels it: inertia and weight."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from kemba.effects.base import At, Contribution, Effect
from kemba.quantity import Param, Tolerance


class Boom(Effect):
    """Boom about its pivot, for small angles: I/l^2 on each axis and its weight's share.

    The lever differs between axes because the body hangs below the boom's end.
    """

    kind: Literal["boom"] = "boom"
    inertia: Annotated[float, Param("kg.m2", 0.1, lower=0.0, doc="about the pivot")] = 4.82
    mass: Annotated[float, Param("kg", 0.1, lower=0.0, doc="mass")] = 2.699
    com: Annotated[float, Param("m", 0.05, lower=0.0, doc="COM from the pivot")] = 1.149
    length_x: Annotated[float, Param("m", 0.05, lower=0.0, doc="lever, horizontal")] = 2.575
    length_z: Annotated[float, Param("m", 0.05, lower=0.0, doc="lever, vertical")] = 2.493

    place: ClassVar[Literal["leg", "body"]] = "body"
    family: ClassVar[str] = "boom"
    equation: ClassVar[str] = "-(I/l_x^2) ax on x; -(I/l_z^2) az - m g com/l_z on z"
    source: ClassVar[str] = "paper II-B (mass, inertia); authors' program (lengths, COM)"
    ports: ClassVar[tuple[str, ...]] = ("body_x", "body_z")
    publishes: ClassVar[tuple[str, ...]] = ("boom_mass_x", "boom_mass_z", "boom_weight")
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
