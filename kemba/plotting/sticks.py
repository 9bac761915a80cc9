"""Stick figures of the robot: one, a strip of them, an animation."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, FuncAnimation, PillowWriter
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from kemba.errors import KembaError
from kemba.folders import ended
from kemba.plotting.source import CYLINDER, MOVIES, Machine, Pose, Source, poses
from kemba.plotting.style import BLACK, BLUE, GREY, INK, PURPLE, SHADE, VERMILLION, paper_style
from kemba.scene import Scene
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


FRAMES = 7  # odd: the middle of a jump is its apex
GAP = 0.08  # m between neighbours
HEAD = 0.04  # m above the highest figure
FOOT = 0.24  # in below the ground, for the times
LARGE = 1.4  # in per metre at which lines have their full width


def film(source: Source, machine: Machine) -> list[Pose]:
    """Poses at even times over the whole trajectory; none when columns are missing."""
    time = source.trajectory.time
    return poses(source, machine, np.linspace(time[0], time[-1], FRAMES))


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


RATE = 25  # frames per second
SLOWER = 5.0  # times slower than life
MARGIN = 0.08  # m around everything
BELOW = 0.05  # m of ground


def save_animation(
    source: Source, machine: Machine, path: str | Path, slower: float = SLOWER
) -> Path:
    """Write a GIF, or an MP4 where ffmpeg is installed. Raises KembaError."""
    path = Path(path)
    writer = _writer(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        animate(source, machine, slower).save(path, writer=writer, dpi=120)
    except OSError as error:
        raise KembaError(str(path), error.strerror or str(error)) from None
    return path


@paper_style
def animate(source: Source, machine: Machine, slower: float = SLOWER) -> FuncAnimation:
    """The motion at `slower` times its duration. Raises KembaError when columns are missing."""
    time = source.trajectory.time
    frames = max(2, round((time[-1] - time[0]) * slower * RATE) + 1)
    shown = poses(source, machine, np.linspace(time[0], time[-1], frames))
    if not shown:
        expected = "body/z, hip/q and piston/x or knee/q of every leg were expected"
        raise KembaError(source.name, "cannot be animated", expected)
    figure, stick = _stage(shown, machine)
    axes = figure.axes[0]
    trail = axes.plot([], [], color=GREY, lw=0.8, zorder=2)[0]
    clock = axes.text(0.01, 0.98, "", transform=axes.transAxes, va="top", color=INK)
    centres = np.array([pose.centre for pose in shown])

    def draw(number: int, *_: Any) -> list[Artist]:
        stick.show(shown[number])
        trail.set_data(*centres[: number + 1].T)
        clock.set_text(f"{shown[number].time:.3f} s   ({slower:g} times slower)")
        return [*stick.lines, trail, clock]

    return FuncAnimation(figure, draw, frames=len(shown), interval=1000 / RATE, blit=False)


def _stage(shown: list[Pose], machine: Machine) -> tuple[Figure, StickFigure]:
    """A figure in which every pose has room."""
    places = np.array([list(pose.points.values()) for pose in shown])
    low, high = places.min(axis=(0, 1)), places.max(axis=(0, 1))
    left, right = low[0] - MARGIN, high[0] + MARGIN
    ground = machine.mechanism.scene.ground.line(left, right)[1].min()
    width, height = right - left, high[1] - ground + MARGIN + BELOW
    inches = 4.0
    figure = Figure(figsize=(inches, inches * height / width))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    draw_ground(axes, machine.mechanism.scene, left, right)
    axes.set_xlim(left, right)
    axes.set_ylim(ground - BELOW, high[1] + MARGIN)
    return figure, StickFigure(axes, machine.mechanism.legs, scale=2.0)


def _writer(path: Path) -> AbstractMovieWriter:
    if ended(path, MOVIES).suffix.lower() == ".gif":
        return PillowWriter(fps=RATE)
    if not FFMpegWriter.isAvailable():
        hint = f"install ffmpeg, or write a GIF: --animate {path.with_suffix('.gif')}"
        raise KembaError(str(path), "MP4 needs the program ffmpeg, which is not here", hint=hint)
    return FFMpegWriter(fps=RATE, extra_args=["-pix_fmt", "yuv420p"])
