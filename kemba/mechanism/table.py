"""Values with units that all tables of a robot file share."""

from __future__ import annotations

from typing import Annotated

from kemba.quantity import Param

Length = Annotated[float, Param("m", doc="length")]
Mass = Annotated[float, Param("kg", lower=0.0, doc="mass")]
Inertia = Annotated[float, Param("kg.m2", lower=0.0, doc="moment of inertia")]
