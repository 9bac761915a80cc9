"""Kinds of terrain: what the ground is from a place on. Every subclass of `Terrain` is a kind."""

from __future__ import annotations

from collections.abc import Iterable
from math import pi, tan
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import casadi as ca
from pydantic import Field

from kemba.config import Section
from kemba.quantity import Param

if TYPE_CHECKING:
    from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
    from pydantic_core import CoreSchema


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


class Ramp(Terrain):
    """`{from: 1.2 m, slope: 10 deg}`; with `height` that of its beginning."""

    slope: Annotated[float, Param("rad", lower=-pi / 4, upper=pi / 4, doc="upwards along x")]
    height: Annotated[float, Param("m", lower=-2.0, upper=2.0, doc="where it begins")] | None = None

    key: ClassVar[str] = "slope"

    def surface(self, x: ca.SX, before: float) -> ca.SX:
        first = before if self.height is None else self.height
        return first + tan(self.slope) * (x - (self.begin or 0.0))


class Level(Terrain):
    """`{from: 0.45 m, height: 0.15 m}`."""

    height: Annotated[float, Param("m", lower=-2.0, upper=2.0, doc="above 0")]

    key: ClassVar[str] = "height"

    def surface(self, x: ca.SX, before: float) -> ca.SX:
        return ca.SX(self.height)


def kinds() -> dict[str, type[Terrain]]:
    """Every kind by the key that tells it from the others; `friction` alone is the plain one."""
    found: list[type[Terrain]] = [*Terrain.__subclasses__(), Terrain]
    return {kind.key: kind for kind in found}


class _OfAnyKind:
    """Marks a field that holds terrain of the kind whose key it has."""

    def members(self) -> Iterable[type[Terrain]]:
        """The classes that are allowed there (to locate errors)."""
        return kinds().values()

    def _read(self, value: Any) -> Terrain:
        if isinstance(value, Terrain):
            return value
        if not isinstance(value, dict) or not value.keys() & kinds().keys():
            raise ValueError(f"says nothing of the ground; one of {', '.join(kinds())} is expected")
        return next(kind for key, kind in kinds().items() if key in value).model_validate(value)

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        from pydantic_core import core_schema

        return core_schema.no_info_plain_validator_function(
            self._read, serialization=core_schema.plain_serializer_function_ser_schema(Terrain.dump)
        )

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return {"anyOf": [kind.model_json_schema() for kind in self.members()]}


AnyTerrain = Annotated[Terrain, _OfAnyKind()]
