"""The hose between tank and valves as a candidate, where chambers say how much air they draw.

An orifice of infinite area is as good as none. So the search is for its reciprocal, which is 0
where all of the tank's pressure reaches the valves.
"""

from __future__ import annotations

from typing import Annotated, ClassVar

from kemba.effects.base import At, Contribution
from kemba.effects.pneumatics.supply_line import SupplyLine
from kemba.identify.problem.types import Candidate, Parameter
from kemba.model.model import Model
from kemba.quantity import Param, Tolerance

LINE = "supply_line"


class LineSettings:
    """Where the supply line's figures are looked for."""

    none = 1e3  # reciprocal of an orifice that is none [m-2]: 200 times a valve's area
    size = 1.5e5  # reciprocal that is neither small nor large [m-2]
    largest = 1e6  # largest reciprocal: an orifice of 1 mm2 [m-2]
    volume = 0.7  # prior width of the logarithm of the volume: a factor of two
    reach = 30.0  # a volume is looked for within this factor


class LineResistance(SupplyLine):
    """The supply line by the reciprocal `r` of its orifice."""

    r: Annotated[float, Param("m-2", 1.5e5, lower=0.0, doc="1/a, 0: no orifice")] = 0.0

    off: ClassVar[dict[str, float]] = {"r": 0.0}
    nominal: ClassVar[dict[str, Tolerance]] = {}

    def evaluate(self, at: At) -> Contribution:
        area = 1.0 / (self.r + LineSettings.none)
        return SupplyLine.evaluate(self.bind({"a": area}), at)  # type: ignore[arg-type]


def line_candidates(model: Model) -> dict[str, Candidate]:
    """The supply line, where the model's chambers publish their flow and it has no line yet."""
    drawing = any("draw_e" in effect.publishes for effect in model.effects)
    if not drawing or any(effect.kind == LINE for effect in model.effects):
        return {}
    settings, volume = LineSettings, float(SupplyLine().V)
    lead = Parameter("r", "m-2", 0.0, settings.size, 0.0, settings.largest)
    ends = (volume / settings.reach, volume * settings.reach)
    hose = Parameter("V", "m3", volume, settings.volume, *ends, volume)
    return {LINE: Candidate(LINE, lead, (hose,), reciprocal={"r": ("a", "m2")})}
