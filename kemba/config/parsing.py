"""Configuration files: from YAML to checked data, every mistake at its line."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from kemba.config.document import Document, Location, dump_yaml, load_text, load_yaml, written
from kemba.errors import ConfigErrors, KembaError, suggest

if TYPE_CHECKING:
    from pydantic import BaseModel

    Schema = TypeVar("Schema", bound=BaseModel)

__all__ = [
    "Document",
    "apply_overrides",
    "beside",
    "dump_yaml",
    "find_config",
    "is_file",
    "load_yaml",
    "locate",
    "parse",
    "shipped_configs",
    "shipped_folder",
]


RANGE = {"equals", "at_least", "at_most"}


def parse(document: Document | Mapping[str, Any], schema: type[Schema]) -> Schema:
    """The document, or the same as a dict, as an instance of a pydantic model.

    Raises ConfigErrors with all mistakes: place, what is wrong, what was expected.
    """
    from pydantic import ValidationError

    from kemba.config.complaints import complaints

    if not isinstance(document, Document):
        document = Document(dict(document))
    try:
        return schema.model_validate(document.data)
    except ValidationError as error:
        raise ConfigErrors(complaints(error, document, schema)) from None


def apply_overrides(document: Document, options: Iterable[str]) -> Document:
    """A copy of the document with `--set` options such as `goals.apex=0.5 m` applied.

    Values are YAML. A plain value for a group of `equals`, `at_least` or `at_most` means `equals`;
    the rest of the group is kept. `parse` checks whether the keys exist.

    Raises ConfigErrors with all options that are not `key=value` or that lead into a value without
    keys.
    """
    data, overrides = document.data, dict(document.overrides)
    errors = []
    for option in options:
        try:
            location, value = _option(option, data)
            data = _replaced(data, location, value)
            for length in range(1, len(location) + 1):
                if length == len(location) or location[:length] not in document.marks:
                    overrides[location[:length]] = f"--set {option}"
        except KembaError as error:
            errors.append(error)
    if errors:
        raise ConfigErrors(errors)
    return dataclasses.replace(document, data=data, overrides=overrides)


def find_config(name: str | Path, folder: str) -> Path:
    """The file `name` as given, or the one shipped in configs/`folder` (`.yaml` may be omitted).

    Raises KembaError with the nearest shipped names.
    """
    return locate(name, (folder,))


def beside(name: str, folder: Path) -> str:
    """The whole path of the file `name` in `folder` or else in the current folder; where there is
    neither, `name` as given, which may be that of a shipped file."""
    near = (path for path in (folder / name, Path(name)) if is_file(path))
    found = next(near, None)
    return name if found is None else str(found.resolve())


def locate(name: str | Path, folders: Collection[str]) -> Path:
    """The path of a YAML file: of the user's own, or one shipped in `folders` of configs/.

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


def _option(option: str, data: Any) -> tuple[Location, Any]:
    """Location and value of one `--set` option."""
    key, equals, text = option.partition("=")
    parts = key.strip().replace("[", ".").replace("]", "").split(".")
    if not equals or not all(parts):
        raise KembaError(f"--set {option}", "is not key=value", "such as --set 'goals.apex=0.5 m'")
    location: list[str | int] = []
    for part in parts:
        if isinstance(data, list):
            if not part.isdigit() or int(part) >= len(data):
                what = f"{written(tuple(location))} has no item '{part}'"
                raise KembaError(f"--set {option}", what, f"0 to {len(data) - 1} was expected")
            location.append(int(part))
            data = data[int(part)]
        elif isinstance(data, dict) or data is None:
            location.append(part)
            data = (data or {}).get(part)
        else:
            what = f"{written(tuple(location))} is a plain value and has no key '{part}'"
            raise KembaError(f"--set {option}", what)
    return tuple(location), load_text(text, f"--set {option}").data


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
