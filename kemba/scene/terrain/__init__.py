"""Kinds of terrain, one file each: a new file in this folder is a new kind."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Annotated, Any

from kemba.scene.terrain.base import Terrain

if TYPE_CHECKING:
    from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
    from pydantic_core import CoreSchema


def kinds() -> dict[str, type[Terrain]]:
    """Every kind by the key that tells it from the others; `friction` alone is the plain one."""
    modules = [import_module(module.name) for module in iter_modules(__path__, f"{__name__}.")]
    own = ((m.__name__, value) for m in modules for value in vars(m).values())
    found = [v for name, v in own if isinstance(v, type) and v.__module__ == name]
    known = [v for v in found if issubclass(v, Terrain)]
    return {kind.key: kind for kind in sorted(known, key=lambda kind: kind is Terrain)}


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


__all__ = ["AnyTerrain", "Terrain", "kinds"]

AnyTerrain = Annotated[Terrain, _OfAnyKind()]
