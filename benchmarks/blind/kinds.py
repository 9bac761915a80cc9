"""What was hidden in a case, what was named, and of which kind the case is."""

from collections.abc import Sequence
from typing import Any

Record = dict[str, Any]
OUTSIDE = (
    "magnet",
    "negative_stiffness",
    "hysteresis",
    "check_valve",
    "temperature_drift",
    "cogging",
    "gear_loss",
    "cable_pull",
    "boom_drag",
    "flexible_boom",
)
SHAPES = ("geometry", "boom_lever", "mass_split")  # kinds of lengths and assembly


def hidden(record: Record) -> list[str]:
    """Names of what was hidden."""
    return [effect["kind"] for effect in record["truth"]]


def kind(record: Record) -> str:
    """null, single, sensor, shape, pair, many or outside."""
    return kind_of(hidden(record))


def kind_of(effects: str | Sequence[str] | None) -> str:
    """The kind of a case by what is hidden in it."""
    names = [effects] if isinstance(effects, str) else list(effects or ())
    if not names:
        return "null"
    if any(name in OUTSIDE for name in names):
        return "outside"
    if len(names) > 1:
        return "pair" if len(names) == 2 else "many"
    if names[0].split(":")[0] in SHAPES:
        return "shape"
    return "sensor" if names[0].startswith("sensor") else "single"


def named(record: Record) -> list[str]:
    """Effects that were added."""
    return list(record["answer"]["added"])


def likely(record: Record) -> list[str]:
    """Effects that the answer names, sure or not."""
    return list(record["answer"]["found"])
