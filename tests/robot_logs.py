"""Short hops of the blind twin as logs: quick to make, with every phase in them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from twin import cases, figures, measure, run, scripts

from kemba.model import load_model
from kemba.plant.execution.repeat import repeat_run
from kemba.trajectory import Trajectory

FRONT_E, FRONT_R, REAR_E, REAR_R = range(4)


def hop(seed: int, duration: float = 0.8) -> scripts.Script:
    """Push off, draw the legs in, land: pulses and hip references drawn anew per seed."""
    rng = np.random.default_rng(seed)
    ticks = scripts.clock(duration, 1000.0, 2e-5, rng)
    on, width, skew = 0.04 + 0.02 * rng.random(), 0.1 + 0.06 * rng.random(), 0.003 * rng.normal()
    pulses = [(FRONT_E, on, on + width), (REAR_E, on, on + width + skew)]
    if seed % 2:
        pulses += [(FRONT_R, 0.30, 0.34), (REAR_R, 0.31, 0.36)]
        pulses += [(FRONT_E, 0.38, 0.40), (REAR_E, 0.40, 0.42), (FRONT_E, 0.55, 0.7)]
    else:
        pulses += [(FRONT_R, 0.25, 0.30), (REAR_R, 0.25, 0.30)]
        pulses += [(FRONT_E, 0.52, 0.56), (REAR_E, 0.50, 0.54), (FRONT_R, 0.54, 0.58)]
    knots = [
        (0.0, 0.0, 0.0),
        (0.25, 0.0, 0.0),
        (0.35, *(0.2 * rng.normal(size=2))),
        (0.5, *(0.1 * rng.normal(size=2))),
        (duration, 0.0, 0.0),
    ]
    return scripts.script(f"hop{seed}", ticks, pulses, offsets=knots)


def hops(
    *effects: dict,
    runs: int = 3,
    seed: int = 0,
    figures_off: float = 0.0,
    pushes: np.ndarray | None = None,
    faults: tuple[dict, ...] = (),
    sensors: measure.Sensors | None = None,
) -> tuple[list[Trajectory], list[np.ndarray]]:
    """Logs with hidden `effects`, and per run the forces (n, 7) of `pushes` (1 sigma) in them."""
    rng = np.random.default_rng(seed)
    robot = figures.Robot().jittered(rng, figures_off)
    logs, forces = [], []
    for i in range(runs):
        script = hop(seed + i)
        push = cases.coloured(script.ticks, np.zeros(7) if pushes is None else pushes, rng)
        truth = run.simulate(script, list(effects), robot, pushes=push)
        columns = measure.robot_log(truth, sensors or measure.Sensors(), faults, rng)
        time = columns.pop("time [s]")
        logs.append(Trajectory(time, columns, {"kind": "robot", "name": f"hop{i}"}))
        forces.append(push)
    return logs, forces


def controller_of(script: scripts.Script) -> Trajectory:
    """The table of a hop as the controller reads it: the hips as the twin moves them."""
    seen = measure.robot_channels(run.simulate(script), measure.Sensors())
    columns: dict[str, np.ndarray] = {}
    for i, leg in enumerate(("front", "rear")):
        q = np.interp(script.ticks, *seen[f"{leg}/hip/q"])
        columns[f"{leg}/hip/q [rad]"] = q
        columns[f"{leg}/hip/w [rad.s-1]"] = np.gradient(q, script.ticks)
        columns[f"{leg}/hip/tau [N.m]"] = np.zeros(len(q))
        columns[f"{leg}/valve/extend [1]"] = script.sent[:, 2 * i]
        columns[f"{leg}/valve/retract [1]"] = script.sent[:, 2 * i + 1]
        columns[f"{leg}/piston/x [m]"] = np.zeros(len(q))
    for name, value in (("x [m]", 0.0), ("z [m]", figures.STANCE_Z), ("pitch [rad]", 0.0)):
        columns[f"body/{name}"] = np.full(len(script.ticks), value)
    return Trajectory(script.ticks, columns)


def plant_hops(folder: Path, runs: int = 3, seed: int = 0) -> list[Path]:
    """Log files of hops of the full plant, with the usual noise of its sensors. The seeds are even:
    hops of odd seeds make it tilt."""
    plant, paths = load_model("plant"), []
    for i in range(2 * seed, 2 * (seed + runs), 2):
        run_folder = folder / f"hop{i}"
        run_folder.mkdir(parents=True)
        controller_of(hop(i)).write(run_folder / "controller.csv")
        (repeat,) = repeat_run(run_folder, plant, run_folder / "logs", noise=True, seed=i)
        paths.append(repeat.path)
    return paths
