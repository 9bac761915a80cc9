"""Three repeats of a jump on the noisy plant, drawn as the paper's Fig. 10.

    python benchmarks/repeats.py RUN PICTURE.png

The paper's robot missed the height of its 0.5 m jump by 3 cm at most.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

from kemba.learn.flight import flight_of
from kemba.plant.execution.repeat import plant_of, repeat_run
from kemba.plotting import load_machine, save_figure
from kemba.plotting.study.repeats import plot_repeats
from kemba.runs import load_run
from kemba.trajectory import Trajectory

PAPER = 0.03  # m, the greatest height error of the paper's three jumps (section IV, Fig. 10)
REPEATS = 3


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
