"""Candidates that need more than their kind: another structure, and the line of the supply.

Orifice chambers in place of the first-order ones: the share `a` of the rod's force comes from them
and 1 - a from the chambers of the model, so that 0 is the model as it is and 1 the other structure.
An orifice of infinite area is as good as none, so the supply line is searched by the reciprocal of
its area, which is 0 where all of the tank's pressure reaches the valves.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any, ClassVar, Literal

from kemba.effects.base import At, Contribution
from kemba.effects.pneumatics.orifice import OrificeChamber
from kemba.effects.pneumatics.supply import SupplyLine
from kemba.identify.problem.problem import Candidate, Parameter
from kemba.model.model import Model
from kemba.quantity import Param, Quantity, Tolerance

ORIFICE = "chambers:orifice"
LEVEL = "level"
FIGURES = {  # as a model that has orifice chambers calls them: as the candidate does
    **{f"orifice_chamber.{k}": k for k in ("a_fill", "a_vent", "V_e", "V_r", "n")},
    "orifice_chamber.gauge": LEVEL,
}

# effects that those figures stand for, once they are free
FREE_THEN = ("supply_scale", "rise_time_scale")
OWN = {"P_e": "P_e_orifice", "P_r": "P_r_orifice"}  # states beside those of the model's chambers

# How far the figures of orifice chambers may be from the usual ones: 1 sigma of their.
AREA = 0.2  # of an orifice's area
VOLUME = 0.3  # of a dead volume
# of the pressure that reaches the valves: the size of `supply_scale`, which it stands for
STRUCTURE_LEVEL = 0.1
REACH = 4.0  # largest error of a figure, in these sigmas
EXPONENT = 0.08  # of the polytropic exponent
# 1 sigma of each figure's logarithm
WIDTHS = {"a_fill": AREA, "a_vent": AREA, "V_e": VOLUME, "V_r": VOLUME,
          LEVEL: STRUCTURE_LEVEL, "n": EXPONENT}  # fmt: skip


class OrificeShare(OrificeChamber):
    """A share of the rod's force that comes from orifice chambers instead of the model's own.

    `level` scales the pressure that reaches the valves.
    """

    kind: Literal["orifice_chamber"] = "orifice_chamber"
    a: Annotated[float, Param("1", 1.0, lower=0.0, upper=1.0, doc="share")] = 0.0
    level: Annotated[float, Param("1", 0.04, lower=0.0, doc="scale of the gauge pressure")] = 1.0

    off: ClassVar[dict[str, float]] = {"a": 0.0}
    publishes: ClassVar[tuple[str, ...]] = ()
    carried_by: ClassVar[dict[str, str]] = {}
    replaces: ClassVar[tuple[str, ...]] = ()
    nominal: ClassVar[dict[str, Tolerance]] = {}

    @property
    def name(self) -> str:
        return ORIFICE

    def states(self) -> dict[str, Quantity]:
        named = super().states()
        return {
            own: replace(named[symbol], name=f"{named[symbol].name}_orifice")
            for symbol, own in OWN.items()
        }

    def evaluate(self, at: At) -> Contribution:
        scaled = self.bind({"gauge": tuple(self.level * g for g in self.gauge)})
        other = OrificeChamber.evaluate(scaled, _OwnPressures(at))  # type: ignore[arg-type]
        own = at.F_e - at.F_r + at.F_mode
        return Contribution(
            effort={"piston": self.a * (other.effort["piston"] - own)},
            rate={OWN[symbol]: rate for symbol, rate in other.rate.items()},
        )


class _OwnPressures:
    """`At` in which the chambers' pressures are those of the share."""

    def __init__(self, at: At) -> None:
        self._at = at

    def __getattr__(self, symbol: str) -> Any:
        return getattr(self._at, OWN.get(symbol, symbol))


def structure_candidates(model: Model) -> dict[str, Candidate]:
    """Orifice chambers, where the model has first-order ones, with their figures free."""
    kinds = {effect.kind for effect in model.effects}
    if not {"chamber", "mode_damping"} <= kinds:
        return {}
    share = OrificeShare().of_cylinder(model.mechanism.need_cylinder())
    declared = share.declared()
    shapes = []
    for name, width in WIDTHS.items():
        param, usual = declared[name], float(share.value(name))
        reach = math.exp(REACH * width)
        low, high = max(param.lower, usual / reach), min(param.upper, usual * reach)
        shapes.append(Parameter(name, param.unit, usual, width, low, high, usual))
    lead = Parameter("a", "1", 0.0, 1.0, 0.0, 1.0)
    return {ORIFICE: Candidate(ORIFICE, lead, tuple(shapes))}


def with_orifices(model: Model, values: Mapping[str, float]) -> Model:
    """The model with orifice chambers in the place of its own, their figures those of `values`;
    the pressure at the valves is left as it is usual."""
    kept = [e for e in model.effects if e.kind not in OrificeChamber.replaces]
    figures = {k: values[k] for k in FIGURES.values() if k in values and k != LEVEL}
    return Model(model.mechanism, [*kept, OrificeChamber(**figures)], model.supply, model.name)


def free_figures(values: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    """The figures of orifice chambers of all legs as nuisance parameters of a model that has them:
    value and 1 sigma by name; `gauge` is the scale of its table."""
    usual = {LEVEL: 1.0, **values}
    return {n: (usual[k], WIDTHS[k] * usual[k]) for n, k in FIGURES.items() if k in usual}


def orifice_item(values: Mapping[str, float]) -> dict[str, Any]:
    """The effect of a model's list with the figures found (by name, SI units)."""
    figures = {k: v for k, v in values.items() if k not in ("a", "level")}
    gauge = [float(f"{values.get('level', 1.0) * g:.6g}") for g in OrificeChamber().gauge]
    return {"kind": "orifice_chamber", **figures, "gauge": gauge}


LINE = "supply_line"

# Where the supply line's figures are looked for.
NONE = 1e3  # reciprocal of an orifice that is none [m-2]: 200 times a valve's area
SIZE = 1.5e5  # reciprocal that is neither small nor large [m-2]
LARGEST = 1e6  # largest reciprocal: an orifice of 1 mm2 [m-2]
LINE_VOLUME = 0.7  # prior width of the logarithm of the volume: a factor of two
LINE_REACH = 30.0  # a volume is looked for within this factor


class LineResistance(SupplyLine):
    """The supply line by the reciprocal `r` of its orifice."""

    kind: Literal["supply_line"] = "supply_line"
    r: Annotated[float, Param("m-2", 1.5e5, lower=0.0, doc="1/a, 0: no orifice")] = 0.0

    off: ClassVar[dict[str, float]] = {"r": 0.0}
    nominal: ClassVar[dict[str, Tolerance]] = {}

    def evaluate(self, at: At) -> Contribution:
        area = 1.0 / (self.r + NONE)
        return SupplyLine.evaluate(self.bind({"a": area}), at)  # type: ignore[arg-type]


def line_candidates(model: Model) -> dict[str, Candidate]:
    """The supply line, where the model's chambers publish their flow and it has no line yet."""
    drawing = any("draw_e" in effect.publishes for effect in model.effects)
    if not drawing or any(effect.kind == LINE for effect in model.effects):
        return {}
    volume = float(SupplyLine().V)
    lead = Parameter("r", "m-2", 0.0, SIZE, 0.0, LARGEST)
    ends = (volume / LINE_REACH, volume * LINE_REACH)
    hose = Parameter("V", "m3", volume, LINE_VOLUME, *ends, volume)
    return {LINE: Candidate(LINE, lead, (hose,), reciprocal={"r": ("a", "m2")})}
