"""Level ground."""

from __future__ import annotations

from typing import Annotated, ClassVar

import casadi as ca

from kemba.quantity import Param
from kemba.scene.terrain.base import Terrain


class Level(Terrain):
    """`{from: 0.45 m, height: 0.15 m}`."""

    height: Annotated[float, Param("m", lower=-2.0, upper=2.0, doc="above 0")]

    key: ClassVar[str] = "height"

    def surface(self, x: ca.SX, before: float) -> ca.SX:
        return ca.SX(self.height)
