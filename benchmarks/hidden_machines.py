# ruff: noqa: E402  (the twin is found first)
"""Hidden machines for the study of learning: robots of the independent twin with several effects.

The twin (tests/twin) has its own equations, contacts (springs), integration and sensors.
"""

import sys
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))

from twin import logs, measure
from twin.cases import DISTURBANCE, coloured, draw
from twin.figures import Robot
from twin.measure import Sensors
from twin.run import Truth
from twin.run import simulate as run_twin
from twin.scripts import Script, from_table

from kemba.events import STAYS, UPRIGHT
from kemba.plant.controller import Gains
from kemba.plotting.source import load_machine
from kemba.trajectory import Trajectory

POOL = (  # of the twin's catalogue: what changes a jump
    *("seal_friction", "pressure_friction", "piston_damping", "supply_scale", "supply_droop"),
    *("valve_delay", "valve_close_delay", "rise_time_scale", "hose_lag", "hip_friction"),
    *("hip_damping", "torque_scale", "motor_lag", "payload", "com_offset", "boom_force"),
    *("boom_inertia", "boom_friction", "boom_damping"),
)
SIZE, SPREAD, FIGURES = 1.0, 0.3, 0.01  # of what matters in practice; its spread; nominal figures
SMALLER, TRIES = 0.7, 5  # a machine that falls at its first jump gets smaller effects
REPEATS = 3
REST = 0.3  # s after the table, so that a landing can be judged


@dataclass(frozen=True)
class Jump:
    """One execution: apex [m] and its error against the plan, as they truly are; whether the
    landing is kept; the log that the sensors wrote."""

    apex: float
    apex_error: float
    landed: bool
    log: Path


@dataclass(frozen=True)
class HiddenMachine:
    """A robot with three to five hidden effects, drawn by its seed; `chambers`: how its air flows,
    first_order as in the planning model, or through an orifice."""

    seed: int
    size: float = SIZE
    chambers: str = "first_order"

    @cached_property
    def effects(self) -> list[dict[str, Any]]:
        rng = np.random.default_rng([self.seed, 40])
        kinds = rng.choice(POOL, size=int(rng.integers(3, 6)), replace=False)
        return [draw(str(kind), self.size, self.seed + 17 * i, Sensors(), SPREAD)
                for i, kind in enumerate(kinds)]  # fmt: skip

    @property
    def robot(self) -> Robot:
        return Robot().jittered(np.random.default_rng([self.seed, 4]), FIGURES)

    def jumps(self, run: Path, folder: Path, visit: int) -> list[Jump]:
        """The controller's table of a run folder executed three times, logs in `folder`."""
        plan = Trajectory.read(run / "trajectory.csv")
        gains = Gains()
        script = _rested(from_table(run / "controller.csv", run.name, gains.K_p, gains.K_d))
        found = []
        for repeat in range(REPEATS):
            kick = np.random.default_rng([self.seed, 2, visit, repeat])
            push = coloured(script.ticks, DISTURBANCE, kick)
            truth = run_twin(script, self.effects, self.robot, self.chambers, pushes=push)
            columns = measure.robot_log(truth, Sensors(), (), kick)
            path = logs.write(folder / f"log-{repeat + 1}.csv", columns)
            noise = {name: Sensors().spread(name.split(" [")[0]) for name in columns
                     if measure.base(name.split(" [")[0]) in measure.CHANNELS}  # fmt: skip
            logs.sidecar(path, "robot", 10 * visit + repeat, run.name, noise)
            apex = float(truth.y[:, 1].max())
            found.append(Jump(apex, apex - float(plan["body/z"].max()), landed(truth), path))
        return found


def machine(seed: int, run: Path, folder: Path, chambers: str = "first_order") -> HiddenMachine:
    """The machine of a seed, its effects as large as it can bear in its first jumps."""
    size = SIZE
    for _ in range(TRIES):
        found = HiddenMachine(seed, size, chambers)
        if all(jump.landed for jump in found.jumps(run, folder, 0)):
            break
        size *= SMALLER
    return found


def landed(truth: Truth) -> bool:
    """Whether the robot stands on both feet at the end, upright, hips and knees off the ground."""
    robot = load_machine("planning")
    names = ("body/x", "body/z", "body/pitch", "front/hip/q", "rear/hip/q",
             "front/piston/x", "rear/piston/x")  # fmt: skip
    columns = {f"{name} [1]": truth.y[:, i] for i, name in enumerate(names)}
    coordinates = robot.coordinates(Trajectory(truth.times, columns))
    if not truth.finite or coordinates is None:
        return False
    points = robot.points(coordinates)
    late = truth.times > truth.times[int(np.argmax(truth.y[:, 1]))]
    heights = {name: place[:, 1] for name, place in points.items()}
    feet = [z[-1] for name, z in heights.items() if name.endswith("foot")]
    others = [z[late].min() for name, z in heights.items() if name.endswith(("hip", "knee"))]
    upright = abs(float(truth.y[-1, 2])) <= UPRIGHT
    return bool(upright and max(feet) <= STAYS and min(others) > 0.0)


def _rested(script: Script) -> Script:
    """The script with its last commands held for some time."""
    more = round(REST * 1000)
    ticks = np.concatenate([script.ticks, script.ticks[-1] + np.arange(1, more + 1) * 1e-3])
    last = script.refs[-1].copy()
    held = [np.repeat(row[None], more, axis=0) for row in (last, script.sent[-1])]
    return Script(
        script.name,
        ticks,
        np.vstack([script.refs, held[0]]),
        np.vstack([script.sent, held[1]]),
        script.start,
    )
