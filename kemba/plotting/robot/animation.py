"""Animation of a motion: the stick figure over its ground, in slow motion."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, FuncAnimation, PillowWriter
from matplotlib.artist import Artist
from matplotlib.figure import Figure

from kemba.errors import KembaError
from kemba.plotting.robot.machine import Machine
from kemba.plotting.robot.poses import Pose, poses
from kemba.plotting.robot.sticks import StickFigure
from kemba.plotting.robot.strip import draw_ground
from kemba.plotting.source import Source
from kemba.plotting.style import GREY, INK, paper_style

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
    ending = path.suffix.lower()
    if ending == ".gif":
        return PillowWriter(fps=RATE)
    if ending != ".mp4":
        what = f"no animation format '{ending}'" if ending else "has no ending"
        raise KembaError(str(path), what, "a name ending in .gif or .mp4 was expected")
    if not FFMpegWriter.isAvailable():
        hint = f"install ffmpeg, or write a GIF: --animate {path.with_suffix('.gif')}"
        raise KembaError(str(path), "MP4 needs the program ffmpeg, which is not here", hint=hint)
    return FFMpegWriter(fps=RATE, extra_args=["-pix_fmt", "yuv420p"])
