"""Walking a pydantic schema along a location, to know which keys could have stood there."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any, get_args

from kemba.config.document import Location


def fields_of(schema: Any) -> dict[str, Any]:
    """The fields of a model or dataclass by the key used in files: FieldInfo or equivalent."""
    own = getattr(schema, "__pydantic_fields__", None)
    if own is None:
        return {item.name: item for item in dataclasses.fields(schema)}
    return {getattr(info, "alias", None) or name: info for name, info in own.items()}


def schemas_in(annotation: Any) -> Iterator[Any]:
    """Every model or dataclass that is named within an annotation such as `list[A | B]`."""
    if hasattr(annotation, "__pydantic_fields__") or dataclasses.is_dataclass(annotation):
        if isinstance(annotation, type):
            yield annotation
        return
    for marker in getattr(annotation, "__metadata__", ()):
        if hasattr(marker, "members"):  # a union whose members are known only when it is read
            yield from marker.members()
            return
    for inner in get_args(annotation):
        yield from schemas_in(inner)


def descend(schema: Any, data: Any, location: Location) -> tuple[list[Any], Location]:
    """The schemas that govern `data` at a pydantic error's location, and the location in `data`.

    pydantic's location also names the branches of unions that it tried; these select a schema
    and are left out of the location returned.
    """
    schemas = [schema]
    place: list[str | int] = []
    for part in location:
        inside = isinstance(data, dict) and part in data
        holders = [item for item in schemas if part in fields_of(item)]
        if isinstance(part, int) and isinstance(data, (list, tuple)):
            data = data[part] if part < len(data) else None
        elif holders and (inside or part == location[-1]):
            annotations = [fields_of(item)[str(part)] for item in holders]
            schemas = [s for info in annotations for s in schemas_in(_annotation(info))]
            data = data[part] if inside else None
        elif inside:
            data = data[part]
        else:
            schemas = [item for item in schemas if _is_branch(part, item)] or schemas
            continue
        place.append(part)
    return schemas, tuple(place)


def _annotation(info: Any) -> Any:
    """The type of a pydantic or a dataclass field."""
    return info.annotation if hasattr(info, "annotation") else info.type


def _is_branch(part: str | int, schema: Any) -> bool:
    """Whether a union's branch that pydantic calls `part` is `schema`."""
    tags = (get_args(_annotation(info)) for info in fields_of(schema).values())
    return part == schema.__name__ or any(part in values for values in tags)
