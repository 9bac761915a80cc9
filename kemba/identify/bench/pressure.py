"""Chamber pressures as a sensor in the chamber would read them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from kemba.identify.problem import Array

BORE, ROD = 0.025, 0.010  # m
AREA = {"extend": np.pi / 4 * BORE**2, "retract": np.pi / 4 * (BORE**2 - ROD**2)}
ATMOSPHERE = 101325.0


def absolute_pressure(channel: str, states: Mapping[str, Array]) -> Array:
    """[Pa], from the chamber's force state, or its own pressure state where it has one."""
    chamber = channel.split("/")[1]
    if f"chamber/{chamber}/P" in states:
        return states[f"chamber/{chamber}/P"]
    return ATMOSPHERE + states[f"chamber/{chamber}/F"] / AREA[chamber]
