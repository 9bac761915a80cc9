"""Configuration files: from YAML to checked data, every mistake at its line."""

import dataclasses
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, get_args

from pydantic import BaseModel, ValidationError

from kemba.config.document import Document, Location, load_text, written
from kemba.errors import ConfigErrors, KembaError, suggest
from kemba.quantity import Param, expectation

Schema = TypeVar("Schema", bound=BaseModel)
RANGE = {"equals", "at_least", "at_most"}


def parse(document: Document | Mapping[str, Any], schema: type[Schema]) -> Schema:
    """The document, or the same as a dict, as an instance of a pydantic model. Raises ConfigErrors
    with all mistakes: place, what is wrong, what was expected."""
    if not isinstance(document, Document):
        document = Document(dict(document))
    try:
        return schema.model_validate(document.data)
    except ValidationError as error:
        raise ConfigErrors(complaints(error, document, schema)) from None


def apply_overrides(document: Document, options: Iterable[str], place: str = "") -> Document:
    """A copy of the document with `--set` options such as `goals.apex=0.5 m` applied.

    Values are YAML. A plain value for a group of `equals`, `at_least` or `at_most` means `equals`;
    the rest of the group is kept. `parse` checks whether the keys exist. `place`: where mistakes in
    them are told, the options themselves by default.

    Raises ConfigErrors with all options that are not `key=value` or that lead into a value without
    keys.
    """
    data, overrides = document.data, dict(document.overrides)
    errors = []
    for option in options:
        try:
            said = place or f"--set {option}"
            location, value = _option(option, data, said)
            data = _replaced(data, location, value)
            for length in range(1, len(location) + 1):
                if length == len(location) or location[:length] not in document.marks:
                    overrides[location[:length]] = said
        except KembaError as error:
            errors.append(error)
    if errors:
        raise ConfigErrors(errors)
    return dataclasses.replace(document, data=data, overrides=overrides)


def with_added(name: str) -> tuple[str, str] | None:
    """A and B of a name `A+B`, the file A with what the file B adds; None for any other name."""
    first, plus, added = name.rpartition("+")
    return (first, added) if plus and not is_file(Path(name)) else None


def beside(name: str, folder: Path) -> str:
    """The whole path of the file `name` in `folder` or else in the current folder; where there is
    neither, `name` as given, which may be that of a shipped file. Of `A+B` both are looked for."""
    if (parts := with_added(name)) is not None and not is_file(folder / name):
        return "+".join(beside(part, folder) for part in parts)
    near = (path for path in (folder / name, Path(name)) if is_file(path))
    found = next(near, None)
    return name if found is None else str(found.resolve())


def find_config(name: str | Path, *folders: str) -> Path:
    """The path of a YAML file: of the user's own, or one shipped in `folders` of configs/ (whose
    `.yaml` may be omitted).

    Raises KembaError where there is no such file, with the nearest shipped name, or where the name
    does not end in .yaml.
    """
    if is_file(Path(name)):
        if Path(name).suffix not in (".yaml", ".yml"):
            raise KembaError(str(name), "is no YAML file", "a name ending in .yaml was expected")
        return Path(name)
    shipped = {key: path for folder in folders for key, path in shipped_configs(folder).items()}
    short = Path(name).name if str(Path(name).parent) in folders else str(name)
    for candidate in (short, f"{short}.yaml"):
        if candidate in shipped:
            return shipped[candidate]
    what = "is a folder" if os.path.isdir(name) else "no such file"  # noqa: PTH112  never raises
    hint = suggest(str(name), shipped) if shipped else ""
    raise KembaError(str(name), what, "a YAML file, of your own or shipped, was expected", hint)


def shipped_configs(folder: str) -> dict[str, Path]:
    """The files shipped in configs/`folder` by name."""
    return {path.name: path for path in sorted(shipped_folder(folder).glob("*.yaml"))}


def shipped_folder(name: str) -> Path:
    """The folder configs/`name` of the checkout or of the installed package."""
    above = Path(__file__).resolve().parents[2]
    checkout = (above / "pyproject.toml").is_file()
    return above / ("configs" if checkout else "kemba_configs") / name


def is_file(path: Path) -> bool:
    """Whether there is such a file; False for names that no file can have, where `Path.is_file`
    raises OSError or ValueError."""
    try:
        return path.is_file()
    except (OSError, ValueError):  # too long, or with a zero in it
        return False


def _option(option: str, data: Any, said: str) -> tuple[Location, Any]:
    """Location and value of one `--set` option, whose mistakes are told at what is `said`."""
    key, equals, text = option.partition("=")
    parts = key.strip().replace("[", ".").replace("]", "").split(".")
    if not equals or not all(parts):
        raise KembaError(said, "is not key=value", "such as --set 'goals.apex=0.5 m'")
    location: list[str | int] = []
    for part in parts:
        if isinstance(data, list):
            if not part.isdigit() or int(part) >= len(data):
                what = f"{written(tuple(location))} has no item '{part}'"
                raise KembaError(said, what, f"0 to {len(data) - 1} was expected")
            location.append(int(part))
            data = data[int(part)]
        elif isinstance(data, dict) or data is None:
            location.append(part)
            data = (data or {}).get(part)
        else:
            what = f"{written(tuple(location))} is a plain value and has no key '{part}'"
            raise KembaError(said, what)
    return tuple(location), load_text(text, said).data


def _replaced(data: Any, location: Location, value: Any) -> Any:
    """A copy of `data` with `value` at `location`; missing groups are created."""
    if not location:
        plain = not isinstance(value, (dict, list)) and value is not None
        if plain and isinstance(data, dict) and RANGE & data.keys():
            return {**{k: v for k, v in data.items() if k not in RANGE}, "equals": value}
        return value
    part, rest = location[0], location[1:]
    if isinstance(data, list):
        return [_replaced(item, rest, value) if i == part else item for i, item in enumerate(data)]
    group = data or {}
    return {**group, str(part): _replaced(group.get(str(part)), rest, value)}


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
        if not (
            all(entry.kind in EXPECTED for entry in entries)
            and any(len(other) > len(place) and other[: len(place)] == place for other in found)
        )
    ]
    last = (len(document.lines), 0)
    kept.sort(key=lambda pair: document.marks.get(document.nearest(pair[0]), last))
    more = error.error_count() - MOST
    rest = [KembaError(document.source, f"and {more} more mistakes")] if more > 0 else []
    return [*(report for _, report in kept), *rest]


def refused(error: ValidationError) -> str:
    """What is wrong with one value, such as that of an option; in pydantic's words of a kind that
    no value of numbers has."""
    item = error.errors(include_url=False)[0]
    kind, bounds = item["type"], {k: _plain(v) for k, v in item.get("ctx", {}).items()}
    wanted = BOUNDS[kind].format(**bounds) if kind in BOUNDS else EXPECTED.get(kind)
    return f"{_shown(item['input'])}: {wanted} was expected" if wanted else item["msg"]


def _plain(value: Any) -> Any:
    return f"{value:g}" if isinstance(value, float) else value


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


def sound(document: Document, schema: type[BaseModel]) -> Document:
    """The document without the parts at which the schema finds a mistake."""
    try:
        schema.model_validate(document.data)
    except ValidationError as error:
        data = document.data
        for item in error.errors(include_url=False, include_context=False):
            data = without(data, descend(schema, document.data, item["loc"])[1])
        return replace(document, data=data)
    return document


def without(data: Any, place: Location) -> Any:
    """A copy of plain data without the key at `place`; of a list with a wrong item without the
    list, as other items would move."""
    if not place or not isinstance(data, dict) or place[0] not in data:
        return data
    part, rest = str(place[0]), place[1:]
    if not rest or isinstance(data[part], list):
        return {key: value for key, value in data.items() if key != part}
    return {**data, part: without(data[part], rest)}
