"""Obstacles: boxes on the ground that feet, knees and hips stay out of."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from kemba.config import Section
from kemba.quantity import Param
from kemba.scene.ground import EDGE, Ground, share_of

BELOW = 0.05  # m; so far below the ground is the surface beside a box, where it asks for nothing

Place = Annotated[float, Param("m", lower=-5.0, upper=5.0, doc="place x")]


class Obstacle(Section):
    """A box: nothing of the robot is within `from` to `to` below its `height` above the ground."""

    begin: Place = Field(alias="from")
    to: Place
    height: Annotated[float, Param("m", lower=0.001, upper=2.0, doc="above the ground")]

    @model_validator(mode="after")
    def _has_width(self) -> Obstacle:
        if self.to <= self.begin:
            raise ValueError(f"to {self.to:g} m does not come after from {self.begin:g} m")
        return self

    @property
    def middle(self) -> float:
        """Its place [m]."""
        return (self.begin + self.to) / 2

    def top(self, ground: Ground) -> float:
        """Height [m] of its top; it stands on the ground under its middle."""
        return float(ground.height(self.middle)) + self.height

    def room(self, ground: Ground, x: Any, z: Any) -> Any:
        """How far [m] points are above the box, rounded outwards as edges of the ground are;
        beside it, above a surface `BELOW` the ground. Arrays or SX."""
        lifted = share_of(x, self.begin - EDGE) * (1 - share_of(x, self.to))
        low = ground.height(x) - BELOW
        return z - low - lifted * (self.top(ground) - low)

    def outline(self, ground: Ground) -> tuple[np.ndarray, np.ndarray]:
        """Places and heights (4,) [m] of its corners."""
        low = [float(ground.height(x)) for x in (self.begin, self.to)]
        top = self.top(ground)
        return (
            np.array([self.begin, self.begin, self.to, self.to]),
            np.array([low[0], top, top, low[1]]),
        )
