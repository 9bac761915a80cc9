"""A pneumatic cylinder with its valves: dimensions, and what was measured on it."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import model_validator

from kemba.config import Section
from kemba.errors import KembaError
from kemba.quantity import Param

# A cylinder of a tenth of a millimetre or of ten metres is a mistake in the unit.
Diameter = Annotated[float, Param("m", lower=1e-4, upper=1.0, doc="diameter")]
Stroke = Annotated[float, Param("m", lower=1e-4, upper=10.0, doc="way of the rod")]


class Bore(Section):
    """Bore, rod and stroke [m]; the rod passes through the retract chamber."""

    bore: Diameter
    rod: float
    stroke: Stroke

    @property
    def area_extend(self) -> float:
        """Area [m2] on which the extend chamber pushes."""
        return math.pi / 4 * self.bore**2

    @property
    def area_retract(self) -> float:
        """Area [m2] on which the retract chamber pushes: of the bore less the rod."""
        return math.pi / 4 * (self.bore**2 - self.rod**2)


Volume = Annotated[float, Param("m3", lower=1e-9, doc="tubes and ports of one chamber")]
Pascal = Annotated[float, Param("Pa", lower=0.0, doc="pressure of the supply")]
Newton = Annotated[float, Param("N", lower=0.0, doc="steady force of a chamber")]
Damping = Annotated[float, Param("N.s.m-1", lower=0.0, doc="damping in a valve mode")]
Second = Annotated[float, Param("s", lower=1e-6, doc="time constant of a chamber")]
Ends = tuple[Second, Second]

# What each figure is proportional to when another cylinder has the same valves.
FORCES, DAMPINGS, TIMES = ("F_extend", "F_retract"), ("c_extend", "c_retract"), ("fill", "vent")


class Cylinder(Bore):
    """One double-acting cylinder, used in every leg; the rod passes through the retract chamber.

    Lengths [m], volume [m3]. `F_*` [N] and `c_*` [N.s.m-1] hold at the supply pressures `pressures`
    [Pa, above the atmosphere]; `fill` and `vent` [s] at the smallest and at the largest volume of
    a chamber. Raises ValueError where figures contradict each other.
    """

    rod: Diameter
    tube: Volume
    pressures: tuple[Pascal, ...]
    F_extend: tuple[Newton, ...]
    F_retract: tuple[Newton, ...]
    c_extend: tuple[Damping, ...]
    c_retract: tuple[Damping, ...]
    c_both: tuple[Damping, ...]
    c_none: Damping
    fill: Ends
    vent: Ends

    @model_validator(mode="after")
    def _consistent(self) -> Cylinder:
        if self.rod >= self.bore:
            raise ValueError(_thick(self.rod, self.bore))
        if list(self.pressures) != sorted(set(self.pressures)) or not self.pressures:
            raise ValueError("`pressures` must increase from entry to entry")
        for name in (*FORCES, *DAMPINGS, "c_both"):
            count = len(getattr(self, name))
            if count != len(self.pressures):
                raise ValueError(
                    f"`{name}` has {count} entries, `pressures` {len(self.pressures)}; "
                    "one entry for each pressure was expected"
                )
        return self

    @property
    def largest(self) -> float:
        """Volume [m3] of the extend chamber with the rod out, tubes included."""
        return self.tube + self.area_extend * self.stroke


class CylinderTable(Section):
    """A cylinder as files write it: what is left out comes from the cylinder `like`, scaled.

    Forces and damping grow with the area of their chamber; a time constant with the volume that
    the same valve must fill or vent. Figures that are given are taken as they are.
    """

    like: str | None = None
    bore: Diameter | None = None
    rod: Diameter | None = None
    stroke: Stroke | None = None
    tube: Volume | None = None
    pressures: tuple[Pascal, ...] | None = None
    F_extend: tuple[Newton, ...] | None = None
    F_retract: tuple[Newton, ...] | None = None
    c_extend: tuple[Damping, ...] | None = None
    c_retract: tuple[Damping, ...] | None = None
    c_both: tuple[Damping, ...] | None = None
    c_none: Damping | None = None
    fill: Ends | None = None
    vent: Ends | None = None

    @model_validator(mode="after")
    def _tables_together(self) -> CylinderTable:
        missing = [n for n in (*FORCES, *DAMPINGS, "c_both") if getattr(self, n) is None]
        if self.pressures is not None and missing:
            raise ValueError(
                f"`pressures` are given, so {', '.join(missing)} must be given at them"
            )
        return self

    def given(self) -> dict[str, Any]:
        """The figures that the file gives."""
        values = {name: getattr(self, name) for name in Cylinder.model_fields}
        return {name: value for name, value in values.items() if value is not None}


def _thick(rod: float, bore: float) -> str:
    return f"the rod ({rod:g} m) is as thick as the bore ({bore:g} m)"


def scaled(known: Cylinder, given: dict[str, Any]) -> dict[str, Any]:
    """All figures of a cylinder: those `given`, the others from `known`, scaled to its size.

    Sources: force = pressure x area, so steady forces and what moving air takes off them (the
    damping of eq. 6) are scaled with the chamber's area; a chamber behind a valve of unchanged
    size fills in a time proportional to its volume (eq. 1: dP/dt = n R T mdot/V at dV = 0).
    Raises KembaError where the rod would not fit.
    """
    sizes = {k: given.get(k, getattr(known, k)) for k in ("bore", "rod", "stroke", "tube")}
    if sizes["rod"] >= sizes["bore"]:
        raise KembaError("", _thick(sizes["rod"], sizes["bore"]))
    new = known.model_copy(update=sizes)
    extend = new.area_extend / known.area_extend
    retract = new.area_retract / known.area_retract
    ends = (new.tube / known.tube, new.largest / known.largest)
    factors = {"F_extend": extend, "c_extend": extend, "F_retract": retract, "c_retract": retract}
    factors["c_both"] = factors["c_none"] = (extend + retract) / 2
    found: dict[str, Any] = {**sizes, "pressures": known.pressures}
    for name, factor in factors.items():
        value = getattr(known, name)
        found[name] = value * factor if name == "c_none" else tuple(v * factor for v in value)
    for name in TIMES:
        found[name] = tuple(t * k for t, k in zip(getattr(known, name), ends, strict=True))
    return found | given
