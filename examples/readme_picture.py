"""The animated picture of the README: a planned jump, and the simulated robot that executes it.

    python examples/readme_picture.py [RUN]

It plans the shipped jump, or takes a run folder, and writes docs/images/jump.gif.
"""

import io
import os
import sys
from pathlib import Path

import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.figure import Figure
from PIL import Image, ImageSequence

import kemba
from kemba.plotting.source import load_machine, load_source, poses
from kemba.plotting.sticks import StickFigure, draw_ground
from kemba.plotting.style import BLUE, GREEN, GREY, INK, VERMILLION, paper_style

OUT = Path(__file__).resolve().parents[1] / "docs/images/jump.gif"
RATE, SLOWER = 16, 4.0  # frames per second; slower than life
COLOURS = 24
SIDES = {"extend": BLUE, "retract": VERMILLION}


@paper_style
def animation(run: Path) -> FuncAnimation:
    """The simulated robot beside its body height, its plan and its valves."""
    plan, done = load_source(run), load_source(run / "plant.csv")
    machine, z = load_machine("planning"), done.trajectory["body/z"]
    end = float(plan.trajectory.time[-1])
    times = np.linspace(0.0, end, round(end * SLOWER * RATE))
    shown = poses(done, machine, times)
    figure = Figure(figsize=(7.6, 3.0), layout="constrained")
    stage, height, valves = figure.subplot_mosaic(
        "ab;ac", width_ratios=(1.0, 1.35), height_ratios=(2.4, 1.0)
    ).values()
    draw_ground(stage)
    stage.set(xlim=(-0.42, 0.42), ylim=(-0.05, 0.62), aspect="equal")
    stage.set_axis_off()
    stick = StickFigure(stage, machine.mechanism.legs, scale=1.5)
    height.plot(plan.trajectory.time, plan.trajectory["body/z"], color=GREY, lw=3, alpha=0.5)
    height.text(0.02, 0.9, "plan", color=GREY, transform=height.transAxes)
    height.text(0.02, 0.78, "simulated robot", color=GREEN, transform=height.transAxes)
    line = height.plot([], [], color=GREEN)[0]
    height.set(xlim=(0.0, end), ylim=(z.min() - 0.02, z.max() + 0.03), ylabel="body height [m]")
    names = [f"{leg}/valve/{side}" for leg in machine.mechanism.legs for side in SIDES]
    used = [name for name in names if done.trajectory[name].any()]
    for row, name in enumerate(used):
        on = done.trajectory[name] > 0.5
        colour = SIDES[name.rsplit("/")[-1]]
        spans = [(start, stop - start) for start, stop in done.spans(on)]
        valves.broken_barh(spans, (-0.4 - row, 0.8), color=colour)
        valves.text(-0.01, -row, name.replace("/valve", ""), ha="right", va="center")
    valves.set(xlim=(0.0, end), ylim=(0.6 - len(used), 0.6), yticks=[], xlabel="time [s]")
    cursors = [axes.axvline(0.0, color=INK, lw=0.8) for axes in (height, valves)]

    def draw(number: int) -> list[object]:
        stick.show(shown[number])
        past = done.trajectory.time <= times[number]
        line.set_data(done.trajectory.time[past], z[past])
        for cursor in cursors:
            cursor.set_xdata([times[number]] * 2)
        return [*stick.lines, line, *cursors]

    return FuncAnimation(figure, draw, frames=len(times), interval=1000 / RATE)


def small(path: Path) -> None:
    """The same GIF with one small palette; the last picture stands for a second."""
    with Image.open(path) as source:
        frames = [frame.convert("RGB") for frame in ImageSequence.Iterator(source)]
    palette = frames[len(frames) // 2].quantize(COLOURS, dither=Image.Dither.NONE)
    frames = [f.quantize(palette=palette, dither=Image.Dither.NONE) for f in frames]
    wait = [1000 // RATE] * (len(frames) - 1) + [1000]
    whole = io.BytesIO()
    frames[0].save(whole, "GIF", save_all=True, append_images=frames[1:], duration=wait, loop=0)
    path.write_bytes(whole.getvalue())


def main() -> None:
    """Write the picture; to the folder KEMBA_PICTURES where that is set."""
    run = Path(sys.argv[1]) if len(sys.argv) > 1 else kemba.plan("jump.yaml").path
    folder = os.environ.get("KEMBA_PICTURES")
    out = Path(folder) / OUT.name if folder else OUT
    animation(run).save(out, writer=PillowWriter(fps=RATE), dpi=100)
    small(out)
    print(f"{out}: {out.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
