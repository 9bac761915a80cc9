"""Tuning numbers of algorithms: frozen dataclasses whose fields say unit, meaning and origin.

Every algorithm has one class of settings and reads it by `current()`. A study tries other values
with `changed`, without touching the algorithm:

>>> class Gate(Settings):
...     longest_gap: float = setting(0.1, "s", "longest pause between rows", "derived: ...")
>>> with changed(Gate, longest_gap=0.2):
...     Gate.current().longest_gap
0.2
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, ClassVar, TypeVar

from typing_extensions import dataclass_transform

from kemba.errors import KembaError, suggest

ORIGINS = ("derived", "literature", "tuned", "convention")
CHOSEN = "convention: chosen by hand, no comparison kept"

S = TypeVar("S", bound="Settings")


def setting(
    value: Any, unit: str, doc: str, origin: str, decides: bool = False, at_most: float = math.inf
) -> Any:
    """A field of `Settings`.

    `unit` as in columns ("1" for none). `origin` begins with one of `ORIGINS`, such as `literature:
    Higham 2002` or `tuned: benchmarks/sensitivity.py`. `decides`: a verdict depends on this
    threshold, so the sensitivity study halves and doubles it. `at_most`: the largest value that has
    a meaning, such as 1 for a share. Raises ValueError for another origin.
    """
    if origin.partition(":")[0] not in ORIGINS:
        raise ValueError(f"origin {origin!r} must begin with one of {', '.join(ORIGINS)}")
    meta = {"unit": unit, "doc": doc, "origin": origin, "decides": decides, "at_most": at_most}
    return dataclasses.field(default=value, metadata=meta)


@dataclass_transform(frozen_default=True, field_specifiers=(setting,))
class Settings:
    """Base of all settings; a subclass becomes a frozen dataclass by itself."""

    classes: ClassVar[list[type[Settings]]] = []

    def __init_subclass__(cls) -> None:
        dataclasses.dataclass(frozen=True)(cls)
        Settings.classes.append(cls)

    @classmethod
    def current(cls: type[S]) -> S:
        """The values in force: the defaults, or what `changed` set. One object per class."""
        found = _CHANGED.get().get(cls)
        if found is None:
            found = _DEFAULTS.setdefault(cls, cls())
        return found  # type: ignore[return-value]


_DEFAULTS: dict[type[Settings], Settings] = {}
_CHANGED: ContextVar[dict[type[Settings], Settings]] = ContextVar("changed settings", default={})  # noqa: B039


@contextmanager
def changed(cls: type[Settings], **values: Any) -> Iterator[None]:
    """Within this block `cls.current()` has other `values`.

    Raises KembaError for unknown names and values that have no meaning.
    """
    known = {f.name: f for f in dataclasses.fields(cls)}  # type: ignore[arg-type]
    for name, value in values.items():
        if name not in known:
            raise KembaError(cls.__name__, f"no setting '{name}'", hint=suggest(name, known))
        if (most := known[name].metadata["at_most"]) < math.inf and value > most:
            raise KembaError(f"{cls.__name__}.{name}", f"is {value:g}", f"at most {most:g}")
    new = dataclasses.replace(cls.current(), **values)  # type: ignore[type-var]
    token = _CHANGED.set({**_CHANGED.get(), cls: new})
    try:
        yield
    finally:
        _CHANGED.reset(token)
