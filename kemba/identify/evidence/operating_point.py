"""In what surroundings each residual row was taken: where its piston was, how fast, how loaded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from kemba.effects.pneumatics.constants import AREA_E, AREA_R, ATMOSPHERE
from kemba.identify.evidence.problem import Array, Labels, Problem, Rows
from kemba.settings import Settings, setting

REGIONS = ("in", "mid", "out")


class RegionSettings(Settings):
    """Regions of a piston's stroke."""

    end: float = setting(
        0.010,
        "m",
        "length of the region at each end of the stroke",
        "derived: as long as a cushion of the catalogue",
    )


@dataclass(frozen=True)
class OperatingPoint:
    """Per row (n,): the piston of the row's leg (of the body: the front leg's) at `x` [m], moving
    at `v` [m.s-1], pushed by the model's air with `force` [N]; `stroke` [m]."""

    x: Array
    v: Array
    force: Array
    stroke: float

    def regions(self) -> Labels:
        """Index (n,) into REGIONS: near the retracted end, between, near the extended end."""
        end = RegionSettings.current().end
        ends = np.array([end, self.stroke - end])
        return np.asarray(np.searchsorted(ends, self.x, side="right"))


@runtime_checkable
class HasOperatingPoint(Protocol):
    """A problem that knows the surroundings of its rows."""

    def operating_point(self) -> OperatingPoint:
        """Those of every row of `rows()`, in the same order."""


def region_labels(problem: Problem, rows: Rows) -> tuple[OperatingPoint | None, Labels]:
    """Surroundings where the problem knows them, and the region's label of every row."""
    if not isinstance(problem, HasOperatingPoint):
        return None, np.full(len(rows), "", dtype=object)
    around = problem.operating_point()
    return around, np.array(REGIONS, dtype=object)[around.regions()]


def air_force(states: Mapping[str, Array], prefix: str = "") -> Array:
    """Push of the air on a rod [N] from the chambers' states by name, in force or in pressure."""
    push = []
    for chamber, area in (("extend", AREA_E), ("retract", AREA_R)):
        name = f"{prefix}chamber/{chamber}/"
        known = states.get(f"{name}F")
        push.append((states[f"{name}P"] - ATMOSPHERE) * area if known is None else known)
    return np.asarray(push[0] - push[1])
