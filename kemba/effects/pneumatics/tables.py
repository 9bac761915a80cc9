"""Figures over the supply pressure: taken from the cylinder where an effect leaves them open, read
between their pressures, extrapolated beyond them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from kemba.effects.base import Effect
from kemba.errors import KembaError

if TYPE_CHECKING:
    from kemba.mechanism import Cylinder

E = TypeVar("E", bound=Effect)


def filled(effect: E, cylinder: Cylinder, names: Sequence[str], tables: Sequence[str]) -> E:
    """`effect` with those of `names` that are None taken from the cylinder.

    `tables` are those with one entry per entry of `pressures`. Raises KembaError where their
    lengths differ.
    """
    left = {n: getattr(cylinder, n) for n in names if getattr(effect, n) is None}
    found = effect.model_copy(update=left)
    count = len(found.value("pressures"))
    for name in tables:
        if len(found.value(name)) != count:
            what = f"{name} has {len(found.value(name))} entries, pressures {count}"
            expected = "one entry for each supply pressure was expected"
            raise KembaError(f"effects.{effect.name}", what, expected)
    return found


def at_supply(effect: Effect, table: str, supply: float) -> Any:
    """A table of an effect, whose entries may be symbols, at a supply pressure [Pa].

    Piecewise linear; beyond the pressures of the table, the line of its last two entries goes on.
    A table of one entry holds at every pressure.
    """
    values, pressures = effect.value(table), np.asarray(effect.value("pressures"))
    if len(pressures) == 1:
        return values[0]
    i = int(np.clip(np.searchsorted(pressures, supply) - 1, 0, len(pressures) - 2))
    share = float((supply - pressures[i]) / (pressures[i + 1] - pressures[i]))
    return (1 - share) * values[i] + share * values[i + 1]


def beyond(effect: Effect, supply: float, tables: Sequence[str]) -> list[str]:
    """What to say of a supply pressure [Pa] outside an effect's tables; nothing inside them.

    Raises KembaError where what is extrapolated is not positive, which cannot be.
    """
    low, high = min(effect.value("pressures")), max(effect.value("pressures"))
    if low <= supply <= high:
        return []
    where, given = f"effects.{effect.name}", f"{supply / 1e6:g} MPa of supply pressure"
    span = f"{low / 1e6:g} to {high / 1e6:g} MPa" if low < high else f"{low / 1e6:g} MPa only"
    found = {name: at_supply(effect, name, supply) for name in tables}
    for name, value in found.items():
        if value <= 0:
            what = f"{given} would make {name} {value:.0f}, which cannot be"
            raise KembaError(where, what, f"the tables hold for {span}")
    values = ", ".join(f"{name} {value:.4g}" for name, value in found.items())
    how = "extrapolated linearly" if low < high else "taken as they are"
    return [f"{where}: {given} is outside the measured range ({span}); {how}: {values}"]
