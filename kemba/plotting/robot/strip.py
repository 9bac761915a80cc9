"""The film strip: stick figures at even times, side by side, with the body's path."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes

from kemba.plotting.robot.machine import Machine
from kemba.plotting.robot.poses import Pose, poses
from kemba.plotting.robot.sticks import StickFigure
from kemba.plotting.source import Source
from kemba.plotting.style import GREY, INK, SHADE
from kemba.trajectory import Array

FRAMES = 7  # odd: the middle of a jump is its apex
GAP = 0.08  # m between neighbours
HEAD = 0.04  # m above the highest figure
FOOT = 0.24  # in below the ground, for the times
LARGE = 1.4  # in per metre at which lines have their full width


def film(source: Source, machine: Machine, frames: int = FRAMES) -> list[Pose]:
    """Poses at even times over the whole trajectory; none when columns are missing."""
    time = source.trajectory.time
    return poses(source, machine, np.linspace(time[0], time[-1], frames))


def strip_height(shown: list[Pose], width: float) -> float:
    """Height [in] of a strip of `width` [in] into which the figures fit exactly."""
    left, right, top = _extent(shown, _shifts(shown))
    return width * (top + HEAD) / (right - left) + FOOT


def draw_strip(
    axes: Axes,
    source: Source,
    machine: Machine,
    shown: list[Pose],
    width: float,
    valves: bool = True,
) -> None:
    """The figures of `shown` from left to right, times below, and the body's path through them.

    `width` [in] is that of the axes; `valves` colours the cylinders by their valves.
    """
    shifts = _shifts(shown)
    left, right, top = _extent(shown, shifts)
    scale = width / (right - left)
    for number, (pose, shift) in enumerate(zip(shown, shifts, strict=True)):
        thick = min(1.0, scale / LARGE)
        StickFigure(axes, machine.mechanism.legs, thick, valves).show(pose, shift)
        label = f"{pose.time:.2f}" + " s" * (number == 0)
        at = float(pose.centre[0] + shift), 0.0
        axes.annotate(
            label, at, (0, -6), textcoords="offset points", ha="center", va="top", fontsize=7
        )
    times = np.linspace(shown[0].time, shown[-1].time, 40 * len(shown))
    path = np.array([pose.centre for pose in poses(source, machine, times)])
    path[:, 0] += np.linspace(shifts[0], shifts[-1], len(times))
    axes.plot(path[:, 0], path[:, 1], color=GREY, lw=0.7, zorder=2, gid="path")
    draw_ground(axes)
    axes.set_xlim(left, right)
    axes.set_ylim(-FOOT / scale, top + HEAD)


def draw_ground(axes: Axes) -> None:
    """The ground as the only axis of a picture with equal scales."""
    axes.axhline(0.0, color=INK, lw=0.7, zorder=1)
    axes.axhspan(-0.03, 0.0, color=SHADE, lw=0, zorder=0)
    axes.set_aspect("equal")
    axes.set_axis_off()


def _shifts(shown: list[Pose]) -> Array:
    """Shifts [m], proportional to time, by which no two neighbours touch."""
    extents = [np.array([place[0] for place in pose.points.values()]) for pose in shown]
    needed = [a.max() - b.min() for a, b in pairwise(extents)]
    apart = float(max(0.3, *needed)) + GAP
    return np.asarray(apart * np.arange(len(shown)), dtype=float)


def _extent(shown: list[Pose], shifts: Array) -> tuple[float, float, float]:
    """Left, right and upper end of all figures."""
    places = np.array([list(pose.points.values()) for pose in shown])
    x = places[:, :, 0] + shifts[:, None]
    return float(x.min() - GAP), float(x.max() + GAP), float(places[:, :, 1].max())
