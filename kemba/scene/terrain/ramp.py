"""A ramp: from the height of the ground before it, or from its own."""

from __future__ import annotations

from math import pi, tan
from typing import Annotated, ClassVar

import casadi as ca

from kemba.quantity import Param
from kemba.scene.terrain.base import Terrain


class Ramp(Terrain):
    """`{from: 1.2 m, slope: 10 deg}`; with `height` that of its beginning."""

    slope: Annotated[float, Param("rad", lower=-pi / 4, upper=pi / 4, doc="upwards along x")]
    height: Annotated[float, Param("m", lower=-2.0, upper=2.0, doc="where it begins")] | None = None

    key: ClassVar[str] = "slope"

    def surface(self, x: ca.SX, before: float) -> ca.SX:
        first = before if self.height is None else self.height
        return first + tan(self.slope) * (x - (self.begin or 0.0))
