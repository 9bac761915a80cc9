"""What is left of a document when the parts that a schema refuses are taken out."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from kemba.config.document import Document, Location
from kemba.config.schema import descend

if TYPE_CHECKING:
    from pydantic import BaseModel


def sound(document: Document, schema: type[BaseModel]) -> Document:
    """The document without the parts at which the schema finds a mistake."""
    from pydantic import ValidationError

    try:
        schema.model_validate(document.data)
    except ValidationError as error:
        data = document.data
        for item in error.errors(include_url=False, include_context=False):
            data = without(data, descend(schema, document.data, item["loc"])[1])
        return replace(document, data=data)
    return document


def without(data: Any, place: Location) -> Any:
    """A copy of plain data without the key at `place`; items of lists stay, others would move."""
    if not place or not isinstance(data, dict) or place[0] not in data:
        return data
    part, rest = str(place[0]), place[1:]
    if not rest:
        return {key: value for key, value in data.items() if key != part}
    return {**data, part: without(data[part], rest)}
