"""Stick figures: the lines that draw a pose."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from kemba.plotting.robot.poses import CYLINDER, Pose
from kemba.plotting.style import BLACK, BLUE, GREY, INK, PURPLE, VERMILLION
from kemba.trajectory import Array

MODES = {(0, 0): GREY, (1, 0): BLUE, (0, 1): VERMILLION, (1, 1): PURPLE}  # extend, retract


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
