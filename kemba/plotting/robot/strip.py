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
from kemba.scene import Scene
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


def strip_height(shown: list[Pose], machine: Machine, width: float) -> float:
    """Height [in] of a strip of `width` [in] into which the figures fit exactly."""
    left, right, low, top = _extent(shown, _shifts(shown), machine.mechanism.scene)
    return width * (top + HEAD - low) / (right - left) + FOOT


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
    left, right, low, top = _extent(shown, shifts, machine.mechanism.scene)
    scale = width / (right - left)
    for number, (pose, shift) in enumerate(zip(shown, shifts, strict=True)):
        thick = min(1.0, scale / LARGE)
        StickFigure(axes, machine.mechanism.legs, thick, valves).show(pose, shift)
        label = f"{pose.time:.2f}" + " s" * (number == 0)
        at = float(pose.centre[0] + shift), low
        axes.annotate(
            label, at, (0, -6), textcoords="offset points", ha="center", va="top", fontsize=7
        )
    times = np.linspace(shown[0].time, shown[-1].time, 40 * len(shown))
    path = np.array([pose.centre for pose in poses(source, machine, times)])
    path[:, 0] += np.linspace(shifts[0], shifts[-1], len(times))
    axes.plot(path[:, 0], path[:, 1], color=GREY, lw=0.7, zorder=2, gid="path")
    scene = machine.mechanism.scene
    if scene.even:
        draw_ground(axes, scene, left, right)
    else:  # every figure stands in the scene by itself
        for pose, shift in zip(shown, shifts, strict=True):
            places = np.array(list(pose.points.values()))[:, 0]
            draw_ground(axes, scene, places.min() - GAP / 2, places.max() + GAP / 2, shift)
    axes.set_xlim(left, right)
    axes.set_ylim(low - FOOT / scale, top + HEAD)


def draw_ground(axes: Axes, scene: Scene, a: float, b: float, shift: float = 0.0) -> None:
    """The ground from `a` to `b` [m], and obstacles there, moved by `shift` in a picture with equal
    scales; it is the picture's only axis."""
    x, h = scene.ground.line(a, b)
    axes.plot(x + shift, h, color=INK, lw=0.7, zorder=1)
    axes.fill_between(x + shift, h, h - 0.03, color=SHADE, lw=0, zorder=0)
    for box in scene.obstacles:
        place, height = box.outline(scene.ground)
        if a < box.middle < b:
            axes.fill(place + shift, height, color=SHADE, ec=INK, lw=0.7, zorder=1)
    axes.set_aspect("equal")
    axes.set_axis_off()


def _shifts(shown: list[Pose]) -> Array:
    """Shifts [m], proportional to time, by which no two neighbours touch."""
    extents = [np.array([place[0] for place in pose.points.values()]) for pose in shown]
    needed = [a.max() - b.min() for a, b in pairwise(extents)]
    apart = float(max(0.3, *needed)) + GAP
    return np.asarray(apart * np.arange(len(shown)), dtype=float)


def _extent(shown: list[Pose], shifts: Array, scene: Scene) -> tuple[float, float, float, float]:
    """Left, right and lower end of all figures with the ground under them, and their upper end."""
    places = np.array([list(pose.points.values()) for pose in shown])
    x = places[:, :, 0] + shifts[:, None]
    low = scene.ground.line(places[:, :, 0].min(), places[:, :, 0].max())[1].min()
    return float(x.min() - GAP), float(x.max() + GAP), float(low), float(places[:, :, 1].max())
