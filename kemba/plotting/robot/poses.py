"""Where the robot's parts are at given times, for every kind of picture; without matplotlib."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from kemba.plotting.robot.machine import Machine
from kemba.plotting.source import Mask, Source
from kemba.trajectory import Array

CYLINDER = 0.125  # m, how long a cylinder's body is drawn

Rows = np.ndarray[Any, np.dtype[np.intp]]


@dataclass(frozen=True)
class Pose:
    """The robot at one time: `points` (2,) by name [m], per leg its valves and contact."""

    time: float
    points: dict[str, Array]
    valves: dict[str, tuple[int, int]]
    stands: dict[str, bool]

    @property
    def centre(self) -> Array:
        """Middle of the hips (2,), which is the body's centre."""
        hips = [place for name, place in self.points.items() if name.endswith("/hip")]
        return np.array(np.mean(hips, axis=0))


def poses(source: Source, machine: Machine, times: Array) -> list[Pose]:
    """The robot at `times` (m,), in s; none when the trajectory lacks the columns for it."""
    coordinates = machine.coordinates(source.trajectory)
    if coordinates is None:
        return []
    known = np.isfinite(coordinates).all(axis=1)
    if not known.any():
        return []
    clock = source.trajectory.time[known]
    smooth = np.column_stack([np.interp(times, clock, c) for c in coordinates[known].T])
    points = machine.points(smooth)
    rows = _rows(source, times)
    legs = machine.mechanism.legs
    stands = {leg: machine.stance(source.trajectory, leg)[rows] for leg in legs}
    valves = {leg: _valves(source, leg, rows) for leg in legs}
    return [
        Pose(
            float(time),
            {name: place[i] for name, place in points.items()},
            {leg: (int(valves[leg][i, 0]), int(valves[leg][i, 1])) for leg in legs},
            {leg: bool(stands[leg][i]) for leg in legs},
        )
        for i, time in enumerate(times)
    ]


def _rows(source: Source, times: Array) -> Rows:
    """The rows whose commands and contact forces act at `times`."""
    clock = source.trajectory.time
    if source.plan:
        return np.clip(np.searchsorted(clock, times, side="left"), 1, len(clock) - 1)
    return np.clip(np.searchsorted(clock, times, side="right") - 1, 0, len(clock) - 1)


def _valves(source: Source, leg: str, rows: Rows) -> Mask:
    """Extend and retract valve (rows, 2), 0 or 1; off where it is not recorded."""
    switched = np.zeros((len(rows), 2), dtype=bool)
    for column, side in enumerate(("extend", "retract")):
        name = f"{leg}/valve/{side}"
        if name in source.trajectory:
            switched[:, column] = source.trajectory[name][rows] > 0.5
    return switched
