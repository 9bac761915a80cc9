"""pydantic's errors as messages for the author of the file."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, NamedTuple

from kemba.config.document import Document, Location, written
from kemba.config.schema import descend, fields_of
from kemba.errors import KembaError, suggest
from kemba.quantity import Param, expectation

if TYPE_CHECKING:
    from pydantic import BaseModel, ValidationError

EXPECTED = {
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "float_type": "a number",
    "float_parsing": "a number",
    "finite_number": "a finite number",
    "string_type": "a text",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "list_type": "a list",
    "tuple_type": "a list",
    "set_type": "a list",
    "dict_type": "a group of keys",
    "model_type": "a group of keys",
    "model_attributes_type": "a group of keys",
    "dataclass_type": "a group of keys",
    "none_required": "nothing",
}
BOUNDS = {  # what a key takes, by pydantic's kind of a bound that a value exceeds
    "greater_than": "more than {gt}",
    "greater_than_equal": "at least {ge}",
    "less_than": "less than {lt}",
    "less_than_equal": "at most {le}",
    "multiple_of": "a multiple of {multiple_of}",
    "string_too_short": "a text of at least {min_length} characters",
    "string_too_long": "a text of at most {max_length} characters",
    "string_pattern_mismatch": "a text of the form {pattern}",
}
MOST = 50  # mistakes of one file; more do not help and take long to find
SHOWN = 80  # characters of a value in a message
UNKNOWN_KEY = ("extra_forbidden", "unexpected_keyword_argument")


class Complaint(NamedTuple):
    """One pydantic error, where it is in the file, and the schemas of the group around it."""

    place: Location
    holders: list[Any]
    kind: str
    value: Any
    message: str
    context: dict[str, Any]


def complaints(
    error: ValidationError, document: Document, schema: type[BaseModel]
) -> list[KembaError]:
    """One KembaError for each place in the document that is wrong, in the file's order.

    When there are more than MOST mistakes, only the first are shown.
    """
    found: dict[Location, list[Complaint]] = {}
    for item in error.errors(include_url=False)[:MOST]:
        place = descend(schema, document.data, item["loc"])[1]
        holders = descend(schema, document.data, item["loc"][:-1])[0]
        context = dict(item.get("ctx", {}))
        entry = Complaint(place, holders, item["type"], item["input"], item["msg"], context)
        found.setdefault(place, []).append(entry)
    kept = [
        _merged(entries, document)
        for place, entries in found.items()
        if not (_all_types(entries) and _any_below(place, found))
    ]
    last = (len(document.lines), 0)
    kept.sort(key=lambda pair: document.marks.get(document.nearest(pair[0]), last))
    more = error.error_count() - MOST
    rest = [KembaError(document.source, f"and {more} more mistakes")] if more > 0 else []
    return [*(report for _, report in kept), *rest]


def _all_types(entries: list[Complaint]) -> bool:
    """Whether a union's branches only say that they are of another type."""
    return all(entry.kind in EXPECTED for entry in entries)


def _any_below(place: Location, found: dict[Location, list[Complaint]]) -> bool:
    """Whether another branch of the union got further, so that its error is the one to show."""
    return any(len(other) > len(place) and other[: len(place)] == place for other in found)


def _merged(entries: list[Complaint], document: Document) -> tuple[Location, KembaError]:
    """The one report on a place, from the errors of all branches of its union."""
    telling = [entry for entry in entries if entry.kind not in EXPECTED]
    if telling:
        return telling[0].place, _report(telling[0], document)
    first = entries[0]
    wanted = dict.fromkeys(EXPECTED[entry.kind] for entry in entries)
    what = _at(first.place, f"{_shown(first.value)} is of the wrong kind")
    expected = " or ".join(wanted) + " was expected"
    if first.value is None and not first.place:
        what, expected = "is empty", "keys such as " + ", ".join(fields_of(first.holders[0]))
    return first.place, document.error(first.place, what, expected)


def _report(found: Complaint, document: Document) -> KembaError:
    """The report on an error other than a wrong type."""
    place = found.place
    if found.kind in UNKNOWN_KEY:
        names = [name for schema in found.holders for name in fields_of(schema)]
        return document.error(place, _at(place, "unknown key"), hint=suggest(str(place[-1]), names))
    if found.kind in ("missing", "missing_argument"):
        return document.error(place, _at(place, "missing"), _expectation(found))
    if found.kind.startswith("union_tag"):
        return _unknown_tag(found, document)
    if found.kind in ("literal_error", "enum"):
        return _not_among(found, document)
    if found.kind == "value_error":
        return document.error(place, _at(place, str(found.context["error"])))
    if found.kind in ("too_short", "too_long"):
        return document.error(place, _at(place, _size(found)), f"{_allowed(found)} expected")
    what = _at(place, f"{_shown(found.value)} is out of range")
    if found.kind in BOUNDS:
        wanted = BOUNDS[found.kind].format(**found.context)
        return document.error(place, what, f"{wanted} was expected")
    what = _at(place, f"{_shown(found.value)} is not what this key takes")
    return document.error(place, what)


def _size(found: Complaint) -> str:
    """How many entries a list or a group of keys has; too many keys are named."""
    value = found.value
    count = len(value) if isinstance(value, (list, tuple, set, dict)) else 0
    named = isinstance(value, dict) and found.kind == "too_long"
    keys = f" ({', '.join(map(str, list(value)[:MOST]))})" if named else ""
    return f"has {count} {'entry' if count == 1 else 'entries'}{keys}"


def _allowed(found: Complaint) -> str:
    """How many entries were expected: `at most 3 were`."""
    least = found.kind == "too_short"
    count = found.context["min_length" if least else "max_length"]
    return f"at {'least' if least else 'most'} {count} {'was' if count == 1 else 'were'}"


def _unknown_tag(found: Complaint, document: Document) -> KembaError:
    """A list item whose `kind` is missing or unknown."""
    key = found.context["discriminator"].strip("'")
    place = (*found.place, key)
    if found.kind == "union_tag_not_found":
        return document.error(place, _at(place, "missing"), "it says what this item is")
    names = re.findall(r"'([^']*)'", found.context["expected_tags"])
    tag = found.context["tag"]
    return document.error(place, _at(place, f"unknown {key} '{tag}'"), hint=suggest(tag, names))


def _not_among(found: Complaint, document: Document) -> KembaError:
    """A value that is not one of the few allowed."""
    what = _at(found.place, f"{_shown(found.value)} is not allowed")
    names = re.findall(r"'([^']*)'", found.context["expected"])
    if names:
        return document.error(found.place, what, hint=suggest(str(found.value), names))
    return document.error(found.place, what, f"{found.context['expected']} was expected")


def _expectation(found: Complaint) -> str:
    """What a key should hold, as its schema says."""
    for schema in found.holders:
        info = fields_of(schema).get(str(found.place[-1]))
        for item in getattr(info, "metadata", ()):
            if isinstance(item, Param):
                return expectation(item.unit)
        if description := getattr(info, "description", None):
            return f"needed: {description}"
    return "this file needs it"


def _at(place: Location, what: str) -> str:
    return f"{written(place)}: {what}" if place else what


def _shown(value: Any) -> str:
    """A value as it is written in the file; of a long one only its kind."""
    names = {dict: "a group of keys", list: "a list", type(None): "nothing"}
    text = str(value)
    return names.get(type(value), f"'{text if len(text) <= SHOWN else text[:SHOWN] + '...'}'")
