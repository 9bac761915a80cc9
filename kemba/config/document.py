"""YAML documents with the line and column of every part."""

import re
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, WithJsonSchema

from kemba.config.reader import LARGEST, PATTERNS, Mark, YamlError, read
from kemba.config.reader import Location as Location
from kemba.errors import ConfigErrors, KembaError
from kemba.files import atomic_text

WIDTH = 100  # characters of a line


def dump_text(data: Any) -> str:
    """Plain data as YAML text; keys keep their order. Raises TypeError for what is no plain
    data."""
    import yaml

    try:
        text: str = yaml.dump(
            data, Dumper=_dumper(), width=WIDTH, sort_keys=False, allow_unicode=True,
            default_flow_style=False,
        )  # fmt: skip
    except yaml.representer.RepresenterError as error:
        raise TypeError(f"cannot be written as YAML: {error}") from None
    return text


@lru_cache(maxsize=1)
def _dumper() -> Any:
    """PyYAML's dumper, made to quote what YAML 1.2 would misread and to indent lists."""
    import yaml

    class Dumper(yaml.SafeDumper):  # type: ignore[misc]
        yaml_implicit_resolvers: Any = {}  # noqa: RUF012  PyYAML's way: by first character

        def increase_indent(self, flow: bool = False, indentless: bool = False) -> Any:
            return super().increase_indent(flow, False)

        def ignore_aliases(self, data: Any) -> bool:
            return True

    for kind, pattern in PATTERNS.items():
        Dumper.add_implicit_resolver(f"tag:yaml.org,2002:{kind}", _whole(pattern), None)
    Dumper.add_representer(float, _float)
    Dumper.add_representer(str, _text)
    return Dumper


def _whole(pattern: Any) -> Any:
    """The pattern for PyYAML, which asks `match` only."""
    return re.compile(rf"(?:{pattern.pattern})\Z")


def _float(dumper: Any, value: float) -> Any:
    """A float as Python writes it, `1e-05`; never as a whole number."""
    named = {"inf": ".inf", "-inf": "-.inf", "nan": ".nan"}
    text = repr(value)
    return dumper.represent_scalar("tag:yaml.org,2002:float", named.get(text, text))


def _text(dumper: Any, value: str) -> Any:
    """A text; with escapes where it holds characters that only YAML reads as line ends, quoted
    where it would merge groups."""
    style = '"' if set(value) & set("\x85\u2028\u2029") or value == "<<" else None
    return dumper.represent_scalar("tag:yaml.org,2002:str", value, style=style)


WIDE = 160  # characters of a line that are shown
TIGHT = re.compile(r"\s*[\w*/.-]+:[^\s/]")  # `height:0.5 m`, which YAML reads as one word


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

    def place(self, location: Location) -> str:
        """Where a part stands, `jump.yaml:31`, or the option that set it; empty where unknown."""
        known = self.nearest(location)
        if known in self.overrides:
            return self.overrides[known]
        return f"{self.source}:{self.marks[known][0] + 1}" if known in self.marks else ""

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
            excerpt = _excerpt(self.lines[line].rstrip(), column)
        return KembaError(where, what, expected, hint, excerpt)


def load_yaml(path: str | Path) -> Document:
    """The document in a YAML 1.2 file. Raises KembaError when the file cannot be read, is not YAML
    or is larger than 2 MB, and ConfigErrors listing all keys that occur twice."""
    try:
        with Path(path).open("rb") as stream:
            content = stream.read(LARGEST + 1)
        text = content.decode("utf-8-sig")
    except OSError as error:
        raise KembaError(str(path), error.strerror or str(error)) from None
    except UnicodeDecodeError:
        if len(content) <= LARGEST:
            raise KembaError(str(path), "is not a UTF-8 text", "a YAML file was expected") from None
    if len(content) > LARGEST:
        raise KembaError(str(path), f"is larger than {LARGEST} bytes", "a YAML file was expected")
    return load_text(text, str(path))


def load_text(text: str, source: str) -> Document:
    """The document in a YAML text; `source` names it in messages. Raises KembaError where the text
    is not valid YAML or a key is given twice."""
    blank = Document(None, source, text.splitlines())
    try:
        found = read(text)
    except YamlError as error:
        raise _syntax_error(error, blank) from None
    if found.twice:
        raise ConfigErrors(_twice(blank, *each) for each in found.twice)
    return Document(found.data, source, blank.lines, found.marks)


def dump_yaml(data: Any, path: str | Path) -> None:
    """Write plain data as YAML, whole or not at all; keys keep their order."""
    with atomic_text(path) as stream:
        stream.write(dump_text(data))


def written(location: Location) -> str:
    """A location as people write it: `effects[0].F_c`."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in location)
    return text.lstrip(".")


def _excerpt(line: str, column: int) -> str:
    """A line with a caret below the column; of a long line only the part around it."""
    start = max(0, column - WIDE // 2) if len(line) > WIDE else 0
    shown, column = line[start : start + WIDE], column - start
    before = "".join("\t" if char == "\t" else " " for char in shown[:column])
    return f"    {shown}\n    {before}^"


def _twice(document: Document, location: Location, first: Mark, second: Mark) -> KembaError:
    """The error of a key that is given twice: at its second place, with the line of the first."""
    what = f"{written(location)}: this key stands twice"
    return document.error_at(*second, what, hint=f"its first value is in line {first[0] + 1}")


def _syntax_error(error: YamlError, document: Document) -> KembaError:
    """A mistake in the YAML text, with its line."""
    if error.mark is None:
        return KembaError(document.source, error.what, hint=error.hint)
    line, column = error.mark
    before = "".join(document.lines[line : line + 1])[: column + 1]
    hint = "indent with spaces, not tabs" if "\t" in before else error.hint
    tight = [n for n, text in enumerate(document.lines[: line + 1], 1) if TIGHT.match(text)]
    if tight and "expected ':'" in error.what:
        hint = f"a space is missing behind the colon in line {tight[-1]}"
    return document.error_at(line, column, error.what, hint=hint)


LONGEST = 80  # characters; file systems allow 255 bytes, endings and numbers included
NAME = rf"\w[\w .+-]{{0,{LONGEST - 1}}}"


def check_name(name: str) -> str:
    """The name, if every system allows it as a file name and it is no path. Raises ValueError."""
    if not re.fullmatch(NAME, name):
        shown = name if len(name) <= LONGEST else f"{name[:LONGEST]}..."
        raise ValueError(
            f"'{shown}' cannot name a file or folder; letters, digits, spaces and _ . + - were "
            f"expected, beginning with a letter or digit, at most {LONGEST} characters"
        )
    return name


FileName = Annotated[
    str, AfterValidator(check_name), WithJsonSchema({"type": "string", "pattern": f"^{NAME}$"})
]


class Section(BaseModel):
    """A frozen part of a file; unknown keys are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)
