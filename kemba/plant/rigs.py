"""The paper's bench rigs: what they impose on a piston, from YAML (configs/rigs)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from kemba.config import find_config, load_yaml, parse
from kemba.mechanism import rig_mechanism
from kemba.plant.commands import Profile
from kemba.plant.drive import Motion, hermite, locked, stroke
from kemba.quantity import Param
from kemba.trajectory import Array

Length = Annotated[float, Param("m", lower=0.0, upper=0.07, doc="rod extension")]
Speed = Annotated[float, Param("m.s-1", lower=0.0, doc="rod speed")]
Second = Annotated[float, Param("s", lower=0.0, doc="time")]
Hertz = Annotated[float, Param("Hz", lower=0.0, doc="rate")]
Pressure = Annotated[float, Param("Pa", lower=0.0, doc="supply pressure")]
Mode = Literal["extend", "retract", "both", "none"]
Mode_VALVES: dict[str, tuple[float, float]] = {
    "extend": (1.0, 0.0), "retract": (0.0, 1.0), "both": (1.0, 1.0), "none": (0.0, 0.0),
}  # fmt: skip


@dataclass(frozen=True)
class Test:
    """One test of a rig: what moves, what is switched, when it is sampled."""

    name: str
    supply: float
    motion: Motion
    valves: dict[str, Profile]
    times: Array
    facts: dict[str, Any]
