"""Figures over the supply pressure: the cylinder's where an effect does not give them, interpolated
between the pressures measured, extrapolated beyond them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import casadi as ca
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


def at_supply(effect: Effect, table: str, supply: Any) -> Any:
    """A table of an effect at a supply pressure [Pa]; entries and pressure may be symbols.

    Piecewise linear; extrapolated from the last two entries beyond the pressures of the table.
    A table of one entry holds at every pressure.
    """
    values, pressures = effect.value(table), np.asarray(effect.value("pressures"))
    if len(pressures) == 1:
        return values[0]
    if isinstance(supply, ca.SX):
        return ca.pw_lin(supply, pressures, ca.vertcat(*values))
    i = int(np.clip(np.searchsorted(pressures, supply) - 1, 0, len(pressures) - 2))
    share = float((supply - pressures[i]) / (pressures[i + 1] - pressures[i]))
    return (1 - share) * values[i] + share * values[i + 1]


def beyond(effect: Effect, supply: float, tables: Sequence[str]) -> list[str]:
    """Remarks on a supply pressure [Pa] outside an effect's tables; nothing inside them. Raises
    KembaError where what is extrapolated is not positive, which is physically impossible."""
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
