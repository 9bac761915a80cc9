"""Three repeats of a jump on the noisy plant, drawn as the paper's Fig. 10.

    python benchmarks/repeats.py RUN PICTURE.png

The paper's robot missed the height of its 0.5 m jump by 3 cm at most.
"""

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from kemba.plant.repeat import plant_of, repeat_run
from kemba.plotting.source import load_machine
from kemba.plotting.style import COLOURS, SHADE, key_above, paper_figure, paper_style, save_figure
from kemba.rounds.correction import flight_of
from kemba.runs import load_run
from kemba.trajectory import Trajectory

PAPER = 0.03  # m, the greatest height error of the paper's three jumps (section IV, Fig. 10)
REPEATS = 3
BODY = (("body/z", "body height [m]", 1.0), ("body/pitch", "pitch [deg]", 180.0 / np.pi))
ACTUATORS = (("hip/q", "hip [deg]", 180.0 / np.pi), ("piston/x", "piston [mm]", 1e3))


@paper_style
def plot_repeats(
    executed: Sequence[Trajectory],
    planned: Trajectory,
    legs: Sequence[str],
    band: float | None = None,
    figure: Figure | None = None,
) -> Figure:
    """Body and actuators of repeated executions over the plan, all by its clock.

    `band` [m] is drawn about the planned height, as a yardstick. `legs` name the columns.
    """
    figure = paper_figure(2.0 * (2 + len(legs)) / 2, figure=figure)
    grid = figure.subplots(1 + len(legs), 2, sharex=True)
    panels = [(grid[0][j], name, label, factor) for j, (name, label, factor) in enumerate(BODY)]
    for i, leg in enumerate(legs, 1):
        for j, (name, label, factor) in enumerate(ACTUATORS):
            panels.append((grid[i][j], f"{leg}/{name}", f"{leg} {label}", factor))
    for axes, name, label, factor in panels:
        for number, log in enumerate(executed):
            hue = COLOURS[number % len(COLOURS)]
            axes.plot(log.time, factor * log[name], color=hue, lw=0.8, label=f"jump {number + 1}")
        axes.plot(
            planned.time, factor * planned[name], color="black", lw=0.9, ls="--", label="plan"
        )
        axes.set_ylabel(label)
    height = grid[0][0]
    if band is not None:
        z = planned["body/z"]
        told = f"plan ± {100 * band:g} cm"
        height.fill_between(planned.time, z - band, z + band, color=SHADE, label=told, zorder=0)
    for axes in grid[-1]:
        axes.set_xlabel("time of the plan [s]")
    key_above(height)
    return figure


def drawn(run: Path, picture: Path, seed: int = 1) -> str:
    """The figure of three executions of a run; their apex errors in words."""
    plan, robot = load_run(run).trajectory, load_machine("planning")
    with tempfile.TemporaryDirectory() as folder:
        done = repeat_run(run, plant_of(run), folder, REPEATS, noise=True, seed=seed)
        logs = [Trajectory.read(repeat.path) for repeat in done]
    legs = robot.mechanism.legs
    picture.parent.mkdir(parents=True, exist_ok=True)
    save_figure(plot_repeats(logs, plan, legs, PAPER), picture)
    planned = flight_of(plan, robot)
    errors = [1e3 * (flight_of(log, robot).apex - planned.apex) for log in logs]
    landed = sum(bool(repeat.replay and repeat.replay.landed) for repeat in done)
    told = ", ".join(f"{error:+.1f}" for error in errors)
    return (
        f"Three executions of `{run.resolve().name}` with noisy sensors and scattering "
        f"valves: apex errors {told} mm, spread {np.ptp(errors):.1f} mm, {landed} of {REPEATS} "
        f"land; the paper's robot missed its height by {1e3 * PAPER:.0f} mm at most (its Fig. 10)"
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path)
    parser.add_argument("picture", type=Path)
    words = parser.parse_args()
    print(drawn(words.run, words.picture))
