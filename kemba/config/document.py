"""YAML documents that remember where everything stands."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kemba.errors import ConfigErrors, KembaError
from kemba.files import atomic_text

if TYPE_CHECKING:
    from ruamel.yaml.nodes import Node

Location = tuple[str | int, ...]


@dataclass(frozen=True)
class Document:
    """Plain data (dicts, lists, scalars) and the place each part of it was read from.

    `marks` maps a location such as `("goals", "apex")` to line and column, counted from 0, of its
    key or list item; `overrides` maps locations set by `--set` to the option's text.
    """

    data: Any
    source: str = ""
    lines: list[str] = field(default_factory=list)
    marks: dict[Location, tuple[int, int]] = field(default_factory=dict)
    overrides: dict[Location, str] = field(default_factory=dict)

    def error(
        self, location: Location, what: str, expected: str = "", hint: str = ""
    ) -> KembaError:
        """A KembaError that points at `location`, or at the nearest part around it."""
        known = self.nearest(location)
        if known in self.overrides:
            return KembaError(self.overrides[known], what, expected, hint)
        if known in self.marks:
            return self.error_at(*self.marks[known], what, expected, hint)
        return KembaError(self.source, what, expected, hint)

    def nearest(self, location: Location) -> Location:
        """The innermost part around `location` whose place is known; `()` is the whole."""
        while location and location not in self.overrides and location not in self.marks:
            location = location[:-1]
        return location

    def error_at(
        self, line: int, column: int, what: str, expected: str = "", hint: str = ""
    ) -> KembaError:
        """A KembaError at a line and column (from 0), with the source line and a caret."""
        where = f"{self.source}:{line + 1}:{column + 1}"
        excerpt = ""
        if line < len(self.lines):
            before = "".join("\t" if char == "\t" else " " for char in self.lines[line][:column])
            excerpt = f"    {self.lines[line].rstrip()}\n    {before}^"
        return KembaError(where, what, expected, hint, excerpt)


def load_yaml(path: str | Path) -> Document:
    """The document in a YAML 1.2 file.

    Raises KembaError when the file cannot be read or is not YAML, and ConfigErrors listing all
    keys that occur twice.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise KembaError(str(path), error.strerror or str(error)) from None
    except UnicodeDecodeError:
        raise KembaError(str(path), "is not a UTF-8 text", "a YAML file was expected") from None
    return load_text(text, str(path))


def load_text(text: str, source: str) -> Document:
    """The document in a YAML text; errors as for `load_yaml`."""
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    yaml = YAML(typ="safe", pure=True)
    yaml.allow_duplicate_keys = True  # found below, all at once
    blank = Document(None, source, text.splitlines())
    try:
        node = yaml.compose(text)
        places = list(_places(node, ())) if node is not None else []
        data = _unshared(yaml.load(text))
    except MarkedYAMLError as error:
        raise _syntax_error(error, blank) from None
    except RecursionError:
        raise KembaError(source, "an alias contains itself, or the nesting is too deep") from None
    except (YAMLError, ValueError) as error:
        raise KembaError(source, f"is not valid YAML: {str(error).splitlines()[0]}") from None
    marks: dict[Location, tuple[int, int]] = {}
    twice = []
    for location, line, column in places:
        if location in marks:
            twice.append(_twice(blank, location, marks[location][0], (line, column)))
        marks.setdefault(location, (line, column))
    if twice:
        raise ConfigErrors(twice)
    return Document(data, source, blank.lines, marks)


def dump_yaml(data: Any, path: str | Path) -> None:
    """Write plain data as YAML, whole or not at all; keys keep their order."""
    with atomic_text(path) as stream:
        stream.write(dump_text(data))


def dump_text(data: Any) -> str:
    """Plain data as YAML text; keys keep their order."""
    from io import StringIO

    from ruamel.yaml import YAML

    yaml = YAML(typ="rt")
    yaml.indent(mapping=2, sequence=4, offset=2)
    yaml.width = 100
    yaml.representer.ignore_aliases = lambda _: True
    stream = StringIO()
    yaml.dump(data, stream)
    return stream.getvalue()


def written(location: Location) -> str:
    """A location as people write it: `effects[0].F_c`."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in location)
    return text.lstrip(".")


def _places(node: Node, location: Location) -> Iterator[tuple[Location, int, int]]:
    """Location, line and column of every key and list item below `node`."""
    from ruamel.yaml.nodes import MappingNode, SequenceNode

    if isinstance(node, MappingNode):
        for key, value in node.value:
            inner = (*location, str(key.value))
            yield inner, key.start_mark.line, key.start_mark.column
            yield from _places(value, inner)
    elif isinstance(node, SequenceNode):
        for index, value in enumerate(node.value):
            yield (*location, index), value.start_mark.line, value.start_mark.column
            yield from _places(value, (*location, index))


def _twice(
    document: Document, location: Location, first_line: int, place: tuple[int, int]
) -> KembaError:
    what = f"{written(location)}: this key stands twice"
    return document.error_at(*place, what, hint=f"its first value is in line {first_line + 1}")


def _syntax_error(error: Any, document: Document) -> KembaError:
    """ruamel's syntax error in our form."""
    mark = error.problem_mark or error.context_mark
    what = f"is not valid YAML: {error.problem or error.context}"
    if mark is None:
        return KembaError(document.source, what)
    if "\t" in "".join(document.lines[mark.line : mark.line + 1])[: mark.column + 1]:
        return document.error_at(mark.line, mark.column, what, hint="indent with spaces, not tabs")
    return document.error_at(mark.line, mark.column, what)


def _unshared(data: Any) -> Any:
    """A copy with text keys and separate aliases, so that setting one leaves the other alone."""
    if isinstance(data, dict):
        return {str(key): _unshared(value) for key, value in data.items()}
    if isinstance(data, list):
        return [_unshared(value) for value in data]
    return data
