"""Executing a run several times, as on hardware, and writing the logs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kemba.config import load_yaml
from kemba.errors import KembaError
from kemba.model import Model, load_model
from kemba.plant.execution.certificate import PLANT
from kemba.plant.execution.controller import Execution, Gains, execute, read_controller
from kemba.plant.execution.counterpart import PLAIN, counterpart
from kemba.plant.execution.replay import Replay
from kemba.plant.execution.sensors import Sensors, take_log
from kemba.plant.simulation.valves import scattered
from kemba.plant.stepping.arrays import Array
from kemba.quantity import to_si
from kemba.scene import scene_in
from kemba.stopwatch import Stage, Tell, silent
from kemba.trajectory import Trajectory

Play = Callable[[Model, Array, list[int], bool], Execution]
VALVE_SCATTER = 1e-4  # s, 1 sigma of every switching on hardware; Fig. 3 shows less than 1 ms


@dataclass(frozen=True)
class Repeat:
    """One execution: the log that was written, and how it compares with the plan (None without
    a plan)."""

    path: Path
    execution: Execution
    replay: Replay | None

    @property
    def summary(self) -> dict[str, Any]:
        """The figures of `kemba-opt simulate --json` for this log."""
        motion = self.execution.trajectory
        facts = {"log": str(self.path), "apex_m": float(motion["body/z"].max())}
        return facts | (self.replay.summary() if self.replay else {})


def kept(repeats: Sequence[Repeat]) -> str:
    """How many of some executions keep the end of their plan: `2 of 3 landed`."""
    found = [repeat.replay for repeat in repeats if repeat.replay]
    does = "stayed upright" if any(one.end for one in found) else "landed"
    return f"{sum(one.landed for one in found)} of {len(repeats)} {does}"


def repeat_run(
    run: str | Path,
    model: Model,
    out: str | Path,
    count: int = 1,
    noise: bool = False,
    seed: int = 0,
    gains: Gains | None = None,
    play: Play | None = None,
    tell: Tell = silent,
) -> list[Repeat]:
    """Execute the controller of a run `count` times on `model` and write `log-1.csv`, ... to `out`.

    With `noise`, sensors are noisy and the valves scatter; the same `seed` gives the same logs.
    `play` executes the table in another way than eq. 10 alone; it gets the model, the times of the
    samples and the numbers that seed it, and whether there is noise. `tell` gets the name of
    each execution. Raises KembaError when `run` has no controller table.
    """
    folder = Path(run)
    controller = folder / "controller.csv" if folder.is_dir() else folder
    if not controller.is_file():
        what = "has no controller.csv" if folder.exists() else "no such run folder or table"
        raise KembaError(str(run), what, hint="make one with: kemba-opt solve jump.yaml")
    table = read_controller(controller)
    plan_file = controller.parent / "trajectory.csv"
    plan = Trajectory.read(plan_file) if plan_file.is_file() else None
    repeats = []
    for number in range(1, count + 1):
        tell(Stage("executing", number, count))
        rng = np.random.default_rng([seed, number])
        sensors = Sensors.usual() if noise else Sensors()
        valves = scattered(model, table, VALVE_SCATTER, rng) if noise else None
        begin = float(table.time[0])
        sample = begin + sensors.times(float(table.time[-1]) - begin, rng)
        if play is None:
            done = execute(table, model, gains, valves=valves, sample=sample)
        else:
            done = play(model, sample, [seed, number, 1], noise)
        log = _as_sent(take_log(done.trajectory, sensors, rng, model.effects), done.table)
        log.meta |= model.mechanism.scene.json()
        log.meta |= {"run": number, "repeat_of": controller.parent.name, "plant": model.name}
        path = Path(out) / f"log-{number}.csv"
        log.write(path)
        repeats.append(Repeat(path, done, done.against(model, plan) if plan else None))
    return repeats


def _as_sent(log: Trajectory, table: Trajectory) -> Trajectory:
    """The log with valve commands as sent: a log cannot show how late each valve acts."""
    row = np.maximum(np.searchsorted(table.time, log.time + 1e-9, side="right") - 1, 0)
    valves = {
        header: table[name][row]
        for header, name in zip(log.headers, log.names, strict=True)
        if "/valve/" in name and name in table
    }
    return log.with_columns(valves)


def plant_of(run: str | Path, name: str | None = None) -> Model:
    """The plant of the task that a run was made for: its robot, supply, payload, own effects.

    Another plant `name` is used unchanged, but on the task's robot, unless its own file names
    one, and with the task's supply and payload.
    """
    file = (Path(run) if Path(run).is_dir() else Path(run).parent) / "task.yaml"
    task = load_yaml(file).data if file.is_file() else None
    if not task:
        return load_model(name or PLANT)
    payload, supply = to_si(task.get("payload") or 0.0, "kg"), task.get("supply")
    own = str(task.get("plant", PLANT))
    return counterpart(
        str(task.get("model", PLAIN)),
        payload,
        None if supply is None else to_si(supply, "Pa"),
        name or own,
        own_effects=name in (None, own),
        changes=task.get("effects"),
        scene=scene_in(task, str(file)),
    )
