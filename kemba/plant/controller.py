"""A plan as the robot's controller executes it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from kemba.config import Section, parse
from kemba.effects.mechanics.hip import Motor
from kemba.errors import KembaError
from kemba.events import STANDS
from kemba.model import Model
from kemba.model.rest import state_at
from kemba.plant.commands import Commands, JointControl, Profile
from kemba.plant.kernel.machine import Array
from kemba.plant.replay import Replay, first_row, judge
from kemba.plant.simulate import (
    Condition,
    Simulated,
    initial_values,
    lowest_foot,
    run_many,
    simulate_one,
)
from kemba.quantity import Param
from kemba.trajectory import SAME_TIME, Trajectory

PERIOD = 1e-3  # s; the controller's rate (paper, IV-B)


class Gains(Section):
    """Gains of the hips' controller, of eq. 10; the paper does not give them."""

    K_p: Annotated[float, Param("N.m.rad-1", lower=0.0)] = 150.0
    K_d: Annotated[float, Param("N.m.s.rad-1", lower=0.0)] = 4.0


@dataclass(frozen=True)
class Execution:
    """An executed controller table: what happened, and the impacts."""

    run: Simulated
    table: Trajectory

    @property
    def trajectory(self) -> Trajectory:
        """The motion, in the clock of the table: the plan begins at 0."""
        return self.run.trajectory

    def against(self, model: Model, plan: Trajectory) -> Replay:
        """The execution compared with the plan it came from."""
        return judge(model, plan, plan.time - plan.time[0], self.run)


def execute(
    controller: Trajectory | str | Path, model: Model, *arguments: Any, **named: Any
) -> Execution:
    """Play a controller table (a run folder, `controller.csv`, or its trajectory) on `model`.

    Further arguments are those of `condition_of`. Raises KembaError when the table lacks a column.
    """
    table = read_controller(controller)
    return Execution(simulate_one(condition_of(table, model, *arguments, **named)), table)


def execute_many(
    controller: Trajectory | str | Path, cases: Iterable[Mapping[str, Any]]
) -> list[Execution | KembaError]:
    """Play a controller table under many conditions side by side on all cores.

    Each case holds the arguments of `execute` but the first, as `{"model": ..., "start": ...}`.
    An execution that fails gives its error. Raises KembaError where a case makes no sense.
    """
    table = read_controller(controller)
    done = run_many([condition_of(table, **case) for case in cases])
    return [d if isinstance(d, KembaError) else Execution(d, table) for d in done]


def condition_of(
    table: Trajectory,
    model: Model,
    gains: Gains | None = None,
    step: float | None = None,
    extra: float = 0.0,
    start: Mapping[str, float] | None = None,
    dead_time: bool = True,
    valves: Mapping[str, Profile] | None = None,
    sample: float | Array = 1e-3,
) -> Condition:
    """What `execute` simulates, in the table's clock.

    The robot starts in the table's first pose, changed by `start`, at rest where the metadata have
    no `start` of a plan that begins in motion. A robot that starts in the air is held until plan
    time 0, and one with a rate has it at that time; its motion begins there. After the last row the
    last commands stay for `extra` [s]. `valves` replace the table's. Raises KembaError when the
    table lacks a column.
    """
    gains = gains or parse({k: table.meta.get(k, v) for k, v in Gains()}, Gains)
    profiles = {
        quantity.name: Profile.of(table.time, _column(table, quantity.name)).from_closed()
        for quantity in model.inputs.values()
        if quantity.binary
    }
    pose = {**first_row(model, table), **(start or {})}
    if "start" in table.meta:
        pose = {**state_at(model, initial_values(model, pose)[0], _start(table)), **pose}
    falls = lowest_foot(model, pose) > STANDS
    moves = any(pose.get(v.name) for v in model.mechanism.velocities)
    begin = 0.0 if falls or moves else float(table.time[0])
    both = {**profiles, **(valves or {})}
    sent = {name: Profile(p.times - begin, p.values) for name, p in both.items()}
    control = hip_control(model, table, gains)
    commands = Commands(sent, replace(control, times=control.times - begin), PERIOD)
    duration = float(table.time[-1]) + extra - begin
    if np.ndim(sample):
        sample = np.asarray(sample) - begin
        sample = sample[(sample >= -SAME_TIME) & (sample <= duration + SAME_TIME)]
    return Condition(model, pose, commands, duration, step, sample, dead_time, begin)


def read_controller(source: Trajectory | str | Path) -> Trajectory:
    """The controller table of a run folder, a CSV file or in memory, by the clock of its plan.

    `lead` in its metadata is the time [s] by which it starts before the plan, whatever the time of
    its first row; without it the table's own clock is taken.
    """
    if not isinstance(source, Trajectory):
        path = Path(source)
        source = Trajectory.read(path / "controller.csv" if path.is_dir() else path)
    begin = -float(source.meta.get("lead", -source.time[0]))
    return source.at_times(source.time - source.time[0] + begin)


def hip_control(model: Model, table: Trajectory, gains: Gains) -> JointControl:
    """The hips follow a controller table within what the motors can give (eq. 10)."""
    legs = model.mechanism.legs
    wanted = [[_column(table, f"{leg}/hip/{name}") for name in ("q", "w", "tau")] for leg in legs]
    return JointControl(
        joints=tuple(f"{leg}/hip" for leg in legs),
        times=table.time,
        wanted=np.ascontiguousarray(np.array(wanted).transpose(2, 0, 1)),
        limits=np.array([motor_limits(motor_of(model, leg)) for leg in legs]).reshape(-1, 3),
        K_p=gains.K_p,
        K_d=gains.K_d,
    )


def motor_of(model: Model, leg: str) -> Motor | None:
    """The motor of a leg's hip; None without one."""
    motors = (e for e in model.effects if isinstance(e, Motor) and e.on in (leg, None))
    return next(motors, None)


def motor_limits(motor: Motor | None) -> tuple[float, float, float]:
    """Peak torque [N.m], speed without load [rad/s], slope [N.m.s/rad] of a `JointControl`."""
    if motor is None:
        return np.inf, np.inf, 1.0
    return motor.tau_peak, motor.w_noload, 1.0 / motor.slope


def _start(table: Trajectory) -> dict[str, float]:
    """The state in which the motion of a table begins, beyond its pose."""
    start = table.meta["start"]
    try:
        return {str(name): float(value) for name, value in start.items()}
    except (AttributeError, TypeError, ValueError):
        what, expected = f"`start` is {start!r}", "the state of the first row by column name"
        raise KembaError("controller.meta.yaml", what, expected) from None


def _column(table: Trajectory, name: str) -> np.ndarray:
    if name not in table:
        raise KembaError("controller", f"has no column '{name}'", "a table as solve writes it")
    return table[name]
