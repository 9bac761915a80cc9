"""Stick figures: poses at given times, and the lines that draw one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from kemba.plotting.robot.machine import Machine
from kemba.plotting.source import Mask, Source
from kemba.plotting.style import BLACK, BLUE, GREY, INK, PURPLE, VERMILLION
from kemba.trajectory import Array

CYLINDER = 0.125  # m, how long a cylinder's body is drawn
MODES = {(0, 0): GREY, (1, 0): BLUE, (0, 1): VERMILLION, (1, 1): PURPLE}  # extend, retract


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


class StickFigure:
    """The robot as lines in an axes with equal scales; `show` moves it to a pose.

    With `valves`, cylinders are blue while extending, vermillion while retracting, purple with
    both valves on.
    """

    def __init__(
        self, axes: Axes, legs: tuple[str, ...], scale: float = 1.0, valves: bool = True
    ) -> None:
        def line(width: float, **look: Any) -> Line2D:
            look = {"color": INK, "solid_capstyle": "round", "zorder": 3, **look}
            return axes.plot([], [], lw=width * scale, **look)[0]

        self.legs, self.valves = legs, valves
        self.cylinders = {leg: line(2.2, solid_capstyle="butt", zorder=5) for leg in legs}
        self.rods = {leg: line(0.7, color=INK, zorder=4) for leg in legs}
        self.limbs = {leg: line(1.3) for leg in legs}
        self.joints = {
            leg: line(0, marker="o", ms=2.2 * scale, mfc="white", mew=0.6 * scale, zorder=6)
            for leg in legs
        }
        self.feet = {leg: line(0, marker="^", ms=3.4 * scale, color=BLACK) for leg in legs}
        self.body = line(3.4, zorder=3.5)

    @property
    def lines(self) -> list[Line2D]:
        """Everything that moves."""
        groups = (self.limbs, self.rods, self.cylinders, self.joints, self.feet)
        return [line for group in groups for line in group.values()] + [self.body]

    def show(self, pose: Pose, shift: float = 0.0) -> None:
        """Draw `pose`, moved forward by `shift` [m]."""
        at = {name: place + np.array([shift, 0.0]) for name, place in pose.points.items()}
        _set(self.body, *(at[f"{leg}/hip"] for leg in self.legs))
        for leg in self.legs:
            hip, knee, foot, mount, pin = (
                at[f"{leg}/{name}"] for name in ("hip", "knee", "foot", "mount", "pin")
            )
            along = (pin - mount) / np.hypot(*(pin - mount))
            end = mount + CYLINDER * along
            _set(self.limbs[leg], hip, knee, foot)
            _set(self.rods[leg], hip, mount, pin)
            _set(self.cylinders[leg], mount, end)
            _set(self.joints[leg], hip, knee)
            _set(self.feet[leg], *((foot - np.array([0.0, 0.012]),) if pose.stands[leg] else ()))
            mode = pose.valves[leg] if self.valves else (0, 0)
            self.cylinders[leg].set_color(MODES[mode])


def _set(line: Line2D, *points: Array) -> None:
    line.set_data([p[0] for p in points], [p[1] for p in points])
