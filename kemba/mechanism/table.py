"""What all tables of a robot file share: frozen rows, values with units, unknown keys refused."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict

from kemba.quantity import Param

Length = Annotated[float, Param("m", doc="length")]
Mass = Annotated[float, Param("kg", lower=0.0, doc="mass")]
Inertia = Annotated[float, Param("kg.m2", lower=0.0, doc="moment of inertia")]


class Table(BaseModel):
    """A frozen row of the link table; unknown keys are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")
