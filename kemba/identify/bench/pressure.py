"""Chamber pressures as a sensor in the chamber would read them."""

from __future__ import annotations

from collections.abc import Mapping

from kemba.effects.pneumatics.constants import AREA_E, AREA_R, ATMOSPHERE
from kemba.identify.evidence.problem import Array

AREA = {"extend": AREA_E, "retract": AREA_R}


def absolute_pressure(channel: str, states: Mapping[str, Array]) -> Array:
    """[Pa], from the chamber's force state, or its own pressure state where it has one."""
    chamber = channel.split("/")[1]
    if f"chamber/{chamber}/P" in states:
        return states[f"chamber/{chamber}/P"]
    return ATMOSPHERE + states[f"chamber/{chamber}/F"] / AREA[chamber]
