"""The kinds of YAML file there are, and the schema of each."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kemba.errors import KembaError, suggest

if TYPE_CHECKING:
    from pydantic import BaseModel

    from kemba.config import Document

# Kind (the folder under configs/) and where its schema lives; a new kind is one line.
SCHEMAS = {
    "tasks": "kemba.ocp.task.task:Task",
    "models": "kemba.model.spec:ModelSpec",
    "robots": "kemba.mechanism.links:RobotFile",
    "cylinders": "kemba.mechanism.cylinder:CylinderTable",
    "sweeps": "kemba.sweep.cases:Sweep",
    "uncertainties": "kemba.scenarios.draw:Uncertainties",
    "rigs": "kemba.plant.rigs:RigFile",
    "maps": "kemba.logs.columns:ColumnMap",
}
# what a file of a kind is called in messages, where its folder's name would mislead
CALLED = {"maps": "column map"}


def schema_of(kind: str) -> type[BaseModel]:
    """The pydantic model of a kind of file. Raises KembaError where there is no such kind, with the
    nearest one."""
    if kind not in SCHEMAS:
        raise KembaError(kind, "no such kind of file", hint=suggest(kind, SCHEMAS))
    module, name = SCHEMAS[kind].split(":")
    found: type[BaseModel] = getattr(import_module(module), name)
    return found


def kind_of(document: Document) -> str:
    """The kind of a document: by its folder, else by the schema that shares most keys with it, of
    several the one with the fewest other keys.

    Raises KembaError where it shares no key with any schema.
    """
    folder = Path(document.source).resolve().parent.name
    if folder in SCHEMAS:
        return folder
    keys, known = _keys(document), {kind: set(schema_of(kind).model_fields) for kind in SCHEMAS}
    best = max(SCHEMAS, key=lambda kind: (len(keys & known[kind]), -len(known[kind])))
    if not keys & known[best]:
        expected = f"keys of one of these were expected: {', '.join(SCHEMAS)}"
        raise KembaError(document.source, "is no kind of file that kemba knows", expected)
    return best


def called(kind: str) -> str:
    """What a file of a kind is called in messages."""
    return CALLED.get(kind, f"{kind.removesuffix('s')} file")


def strays(document: Document, kind: str) -> list[KembaError]:
    """Which keys of a document are those of another kind of file than the one it was taken for."""
    left = _keys(document) - set(schema_of(kind).model_fields)
    others = [other for other in SCHEMAS if left & set(schema_of(other).model_fields)]
    if not others:
        return []
    names = " or ".join(f"a {called(other)}" for other in others)
    what = f"was checked as a {called(kind)}, but has keys of {names}"
    expected = "a file of one kind was expected, best in a folder of that name"
    return [KembaError(document.source, what, f"{expected} ({', '.join([kind, *others])})")]


def _keys(document: Document) -> set[Any]:
    return set(document.data if isinstance(document.data, dict) else ())
