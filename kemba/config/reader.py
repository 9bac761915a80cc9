"""Reading YAML text: plain data with the place of each part. Sizes are limited; no code is run.

`on`, `yes` and `1_000` are texts, unlike in YAML 1.1.

The parser is PyYAML's (libyaml where it is installed). Only its events are used; tags never
choose a Python class.
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

NULL = re.compile(r"|~|null|Null|NULL")
BOOL = re.compile(r"true|True|TRUE|false|False|FALSE")
INT = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
FLOAT = re.compile(
    r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?"
    r"|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)"
)
# in the order in which they are tried
PATTERNS = {"null": NULL, "bool": BOOL, "int": INT, "float": FLOAT}

LONGEST_NUMBER = 40  # digits and signs; a float has 17 that count


def resolve(text: str) -> tuple[str, Any]:
    """The kind of a plain scalar (`null`, `bool`, `int`, `float` or `str`) and its value. Raises
    ValueError, in words for the author, for numbers that no float can hold."""
    kind = next((name for name, pattern in PATTERNS.items() if pattern.fullmatch(text)), "str")
    if kind in ("int", "float") and len(text) > LONGEST_NUMBER:
        raise ValueError(f"this number has {len(text)} characters; {LONGEST_NUMBER} are allowed")
    return kind, _VALUES[kind](text)


def _int(text: str) -> int:
    base = {"0o": 8, "0x": 16}.get(text[:2], 10)
    return int(text[2:] if base != 10 else text, base)


def _float(text: str) -> float:
    if text.lower().endswith(("inf", "nan")):
        return float(text.replace(".", ""))
    number = float(text)
    if math.isinf(number):
        raise ValueError(f"'{text}' is larger than any number that can be computed with")
    return number


_VALUES: dict[str, Any] = {
    "null": lambda text: None,
    "bool": lambda text: text.lower() == "true",
    "int": _int,
    "float": _float,
    "str": str,
}


Location = tuple[str | int, ...]
Mark = tuple[int, int]

CORE = "tag:yaml.org,2002:"


LARGEST = 2_000_000  # B; of a file (a second of reading)
# keys, items and values, those behind aliases included (ten times the largest shipped file,
# read within a second)
MOST_NODES = 20_000
DEEPEST = 30  # nested groups (no schema is deeper than 8)
MOST_ALIASES = 200  # uses of `*name` (far above any use)
LONGEST_KEY = 200  # characters of a key (no column name is longer)
LONGEST_TEXT = 20_000  # characters of a value (five pages of notes)


class YamlError(Exception):
    """A mistake in YAML text, at a line and column counted from 0 (None: nowhere)."""

    def __init__(self, what: str, mark: Mark | None = None, hint: str = "") -> None:
        super().__init__(what)
        self.what, self.mark, self.hint = what, mark, hint


@dataclass
class Tree:
    """A node of the text: `value` is a scalar, or a list of (key or number, its place, tree)."""

    mark: Mark
    value: Any = None
    kind: str = "scalar"
    closed: bool = True


@dataclass
class Read:
    """Data with the places of its parts, and keys that occur twice: location and both marks."""

    data: Any = None
    marks: dict[Location, Mark] = field(default_factory=dict)
    twice: list[tuple[Location, Mark, Mark]] = field(default_factory=list)
    count: int = 0

    def into(self, tree: Tree, location: Location) -> Any:
        """The data of a tree at `location`, whose parts' lines are written down, and which keys are
        given twice. An aliased tree counts at every alias, and is a copy there.

        Raises YamlError where aliases make the tree too large or too deep.
        """
        self.count += 1
        if self.count > MOST_NODES or len(location) > DEEPEST:
            what = f"its aliases stand for more than {MOST_NODES} keys and values"
            if len(location) > DEEPEST:
                what = f"its aliases are nested deeper than {DEEPEST} levels"
            raise YamlError(what, tree.mark)
        if tree.kind == "scalar":
            return tree.value[2]
        parts: dict[str | int, Any] = {}
        for part, mark, inner in tree.value:
            place = (*location, part)
            if place in self.marks:
                self.twice.append((place, self.marks[place], mark))
            else:
                self.marks[place] = mark
            parts[part] = self.into(inner, place)
        return parts if tree.kind == "map" else [*parts.values()]


def read(text: str) -> Read:
    """The data of a YAML text with one document. Raises YamlError."""
    if len(text) > LARGEST:
        raise YamlError(f"is longer than {LARGEST} characters")
    found, tree = Read(), _Builder().tree(text)
    if tree is not None:
        found.data = found.into(tree, ())
    return found


class _Builder:
    """From events to a tree. Aliases share their tree, so they take no memory here."""

    def __init__(self) -> None:
        self.anchors: dict[str, Tree] = {}
        self.open: list[tuple[Tree, list[tuple[str, Mark] | None]]] = []
        self.root: Tree | None = None
        self.count = self.aliases = 0

    def tree(self, text: str) -> Tree | None:
        """The tree of the one document; None when the text is empty. Raises YamlError where the
        text is not valid YAML, goes beyond the limits, or holds a second document."""
        for event in _events(text):
            mark = (event.start_mark.line, event.start_mark.column)
            name = type(event).__name__
            if name == "DocumentStartEvent" and self.root is not None:
                raise YamlError("a second document begins here", mark, "one file is one document")
            if name == "ScalarEvent":
                self._add(self._scalar(event, mark), event.anchor)
            elif name == "AliasEvent":
                self._add(self._alias(event.anchor, mark), None)
            elif name in ("MappingStartEvent", "SequenceStartEvent"):
                kind = "map" if name.startswith("M") else "seq"
                self._begin(Tree(mark, [], kind, closed=False), event, kind)
            elif name in ("MappingEndEvent", "SequenceEndEvent"):
                self.open.pop()[0].closed = True
        return self.root

    def _begin(self, tree: Tree, event: Any, kind: str) -> None:
        if event.tag not in (None, "!", CORE + kind):
            raise YamlError(_tag(event.tag), tree.mark, "leave the tag out")
        if len(self.open) >= DEEPEST:
            raise YamlError(f"is nested deeper than {DEEPEST} levels", tree.mark)
        self._add(tree, event.anchor)
        self.open.append((tree, [None]))

    def _add(self, tree: Tree, anchor: str | None) -> None:
        """Add a node at its place: as a key, a value, an item, or the whole document."""
        self.count += 1
        if self.count > MOST_NODES:
            raise YamlError(f"has more than {MOST_NODES} keys and values", tree.mark)
        if anchor is not None:
            self.anchors[anchor] = tree
        if not self.open:
            self.root = tree
            return
        holder, key = self.open[-1]
        if holder.kind == "seq":
            holder.value.append((len(holder.value), tree.mark, tree))
        elif key[0] is None:
            key[0] = (self._key(tree), tree.mark)
        else:
            holder.value.append((*key[0], tree))
            key[0] = None

    def _key(self, tree: Tree) -> str:
        if tree.kind != "scalar":
            raise YamlError("a group or list cannot be a key", tree.mark, "a text was expected")
        text = str(tree.value[1])
        if text == "<<" and not tree.value[0]:
            what = "'<<' (merging of groups) is not part of YAML 1.2"
            raise YamlError(what, tree.mark, "write the keys out, or use 'base' in a model")
        if len(text) > LONGEST_KEY:
            what = f"this key has {len(text)} characters; {LONGEST_KEY} are allowed"
            raise YamlError(what, tree.mark)
        return text

    def _alias(self, name: str, mark: Mark) -> Tree:
        self.aliases += 1
        if self.aliases > MOST_ALIASES:
            raise YamlError(f"has more than {MOST_ALIASES} aliases", mark)
        if name not in self.anchors:
            raise YamlError(f"the alias '*{name}' has no anchor '&{name}' before it", mark)
        if not self.anchors[name].closed:
            raise YamlError(f"the alias '*{name}' contains itself", mark)
        return self.anchors[name]

    def _scalar(self, event: Any, mark: Mark) -> Tree:
        """`value`: whether it is quoted, its text, and its value."""
        text: str = event.value
        if len(text) > LONGEST_TEXT:
            what = f"this text has {len(text)} characters; {LONGEST_TEXT} are allowed"
            raise YamlError(what, mark)
        plain, tag = event.implicit[0], event.tag
        try:
            if tag in (None, "!"):
                return Tree(mark, (not plain, text, resolve(text)[1] if plain else text))
            wanted = tag.removeprefix(CORE)
            if wanted == "str":
                return Tree(mark, (True, text, text))
            kind, value = resolve(text)
        except ValueError as error:
            raise YamlError(str(error), mark) from None
        if wanted not in ("null", "bool", "int", "float"):
            raise YamlError(_tag(tag), mark, "leave the tag out")
        if (kind, wanted) == ("int", "float"):
            kind, value = "float", float(value)
        if kind != wanted:
            raise YamlError(f"'{text[:40]}' is no {wanted}, as its tag says", mark)
        return Tree(mark, (False, text, value))


def _events(text: str) -> Iterator[Any]:
    """PyYAML's events. Raises YamlError at syntax errors."""
    import yaml

    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        yield from yaml.parse(text, Loader=loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        what = f"is not valid YAML: {error.problem or error.context}"
        if "nesting depth" in str(error.problem):  # libyaml reads ahead, to a limit of its own
            what = f"is nested deeper than {DEEPEST} levels"
        raise YamlError(what, (mark.line, mark.column) if mark else None) from None
    except (yaml.YAMLError, ValueError) as error:
        raise YamlError(f"is not valid YAML: {str(error).splitlines()[0]}") from None


def _tag(tag: str) -> str:
    short = tag.replace(CORE, "!!")
    return f"the tag '{short[:60]}' is not allowed; YAML never runs code or makes objects here"
