"""YAML files to be tried: made from a kind's JSON Schema, or a shipped file with damage."""

import copy
import re
from collections.abc import Callable
from functools import lru_cache
from typing import Any

from hypothesis import strategies as st

from fuzz.values import anything, numbers, texts
from kemba.config import load_yaml, shipped_configs
from kemba.config.document import dump_text
from kemba_cli.schemas import SCHEMAS, schema_of

Data = Any
Draw = Callable[[st.SearchStrategy[Any]], Any]
KINDS = tuple(SCHEMAS)
DEEPEST = 6


@lru_cache
def schema(kind: str) -> dict[str, Any]:
    """The JSON Schema of a kind of file."""
    return schema_of(kind).model_json_schema()


@lru_cache
def shipped(kind: str) -> tuple[Data, ...]:
    """The data of all shipped files of a kind."""
    return tuple(load_yaml(path).data for path in shipped_configs(kind).values())


def _made(draw: Draw, node: dict[str, Any], whole: dict[str, Any], depth: int) -> Data:
    """A value that fits a part of a schema; one in twenty fits nothing."""
    if draw(st.integers(0, 19)) == 0 or depth > DEEPEST:
        return draw(anything)
    if "$ref" in node:
        return _made(draw, whole["$defs"][node["$ref"].split("/")[-1]], whole, depth)
    if "const" in node:
        return node["const"]
    if "enum" in node:
        return draw(st.sampled_from(node["enum"]))
    for union in ("anyOf", "oneOf"):
        if union in node:
            return _made(draw, draw(st.sampled_from(node[union])), whole, depth)
    of_type: dict[str, Callable[[], Data]] = {
        "object": lambda: _group(draw, node, whole, depth + 1),
        "array": lambda: _list(draw, node, whole, depth + 1),
        "string": lambda: draw(texts),
        "integer": lambda: draw(st.integers(-2, 50)),
        "number": lambda: draw(numbers),
        "boolean": lambda: draw(st.booleans()),
        "null": lambda: None,
    }
    return of_type.get(node.get("type", ""), lambda: draw(anything))()


def _group(draw: Draw, node: dict[str, Any], whole: dict[str, Any], depth: int) -> Data:
    known, needed = node.get("properties", {}), set(node.get("required", ()))
    kept = [k for k in known if k in needed or draw(st.integers(0, 2)) == 0]
    found = {key: _made(draw, known[key], whole, depth) for key in kept}
    others = node.get("additionalProperties")
    if isinstance(others, dict):
        keys = draw(st.lists(texts, max_size=3, unique=True))
        found |= {key: _made(draw, others, whole, depth) for key in keys}
    return found


def _list(draw: Draw, node: dict[str, Any], whole: dict[str, Any], depth: int) -> Data:
    if "prefixItems" in node:
        return [_made(draw, item, whole, depth) for item in node["prefixItems"]]
    item = node.get("items", {})
    return [_made(draw, item, whole, depth) for _ in range(draw(st.integers(0, 3)))]


@st.composite
def from_schema(draw: Draw, kind: str) -> Data:
    """Data that nearly fits the schema of a kind."""
    return _group(draw, schema(kind), schema(kind), 0)


@st.composite
def damaged(draw: Draw, kind: str) -> Data:
    """A shipped file with one to three parts replaced, removed, renamed or doubled."""
    data = copy.deepcopy(draw(st.sampled_from(shipped(kind))))
    for _ in range(draw(st.sampled_from([1, 1, 1, 2, 3]))):
        data = _damage(draw, data)
    return data


def _damage(draw: Draw, data: Data) -> Data:
    if not isinstance(data, dict | list) or not data:
        return draw(anything)
    place = draw(st.sampled_from(list(data) if isinstance(data, dict) else list(range(len(data)))))
    inner = data[place]
    if isinstance(inner, dict | list) and inner and draw(st.integers(0, 2)):
        data[place] = _damage(draw, inner)
        return data
    how = draw(
        st.sampled_from([*["scale"] * 6, "replace", "replace", "remove", "rename", "double"])
    )
    if how == "scale" and not isinstance(inner, dict | list | bool | None):
        data[place] = _scaled(draw, inner)
    elif how in ("scale", "replace"):
        data[place] = draw(anything)
    elif how == "remove":
        del data[place]
    elif isinstance(data, list):
        data.insert(place, copy.deepcopy(inner))
    else:
        del data[place]
        data[str(place) + "s" if how == "rename" else draw(texts)] = inner
    return data


def _scaled(draw: Draw, value: Any) -> Any:
    """A number, or a text that begins with one, times a factor: mostly still allowed."""
    factor = draw(st.sampled_from([-1.0, 0.0, 0.01, 0.5, 0.9, 1.1, 2.0, 10.0, 1e6]))
    if isinstance(value, int | float):
        whole = isinstance(value, int) and factor == int(factor)
        return value * int(factor) if whole else value * factor
    number = re.match(r"[-+]?\d*\.?\d+(e[-+]?\d+)?", str(value))
    if number is None:
        return draw(texts)
    return f"{float(number[0]) * factor:g}{value[number.end() :]}"


@st.composite
def yaml_text(draw: Draw, kind: str) -> str:
    """The text of a file of a kind, in one case of four with damage to the text itself."""
    data = draw(st.one_of(from_schema(kind), damaged(kind), damaged(kind)))
    text = dump_text(data)
    if draw(st.integers(0, 3)):
        return text
    at = draw(st.integers(0, max(len(text) - 1, 0)))
    piece = draw(
        st.sampled_from(["\t", ":", "- ", "&a ", "*a", "<<: ", "!!set ", '"', "\n", "{", "\x07"])
    )
    return draw(st.sampled_from([text[:at], text[:at] + piece + text[at:], text + text]))
