"""A line of `terrain`: what the ground is from a place on."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

import casadi as ca
from pydantic import Field

from kemba.config import Section
from kemba.quantity import Param


class Terrain(Section):
    """The ground from the place `from` on, up to the next line that says the same; without
    `from`, everywhere. A line with nothing but `friction` changes no height."""

    begin: Annotated[float, Param("m", lower=-5.0, upper=5.0, doc="place x")] | None = Field(
        default=None, alias="from"
    )
    friction: Annotated[float, Param("1", lower=0.0, doc="friction coefficient")] | None = None

    key: ClassVar[str] = "friction"  # by which a line is known to be of this kind

    def surface(self, x: ca.SX, before: float) -> ca.SX | None:
        """Height [m] at x [m], smooth also before `from`; `before`: height of the ground that ends
        there. None: it stays as it is."""
        return None

    def dump(self) -> dict[str, Any]:
        """The line as a file writes it."""
        return self.model_dump(mode="json", by_alias=True, exclude_none=True)
