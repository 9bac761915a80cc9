"""Chamber pressures as a sensor in the chamber would read them."""

from __future__ import annotations

from collections.abc import Mapping

from kemba.effects.pneumatics.constants import ATMOSPHERE
from kemba.identify.problem.problem import Array
from kemba.mechanism import Cylinder


def absolute_pressure(channel: str, states: Mapping[str, Array], cylinder: Cylinder) -> Array:
    """[Pa], from the chamber's force state, or its own pressure state where it has one."""
    chamber = channel.split("/")[1]
    if f"chamber/{chamber}/P" in states:
        return states[f"chamber/{chamber}/P"]
    area = cylinder.area_extend if chamber == "extend" else cylinder.area_retract
    return ATMOSPHERE + states[f"chamber/{chamber}/F"] / area
