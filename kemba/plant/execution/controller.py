"""The robot's controller (paper, eq. 10): hips PD with feed-forward, valves open loop."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from kemba.effects.mechanics.motor import Motor
from kemba.errors import KembaError
from kemba.model import Model
from kemba.plant.execution.replay import ON_GROUND, Replay, first_row, judge
from kemba.plant.simulation.commands import SAME_TIME, Commands, Feedback, Profile, Sense
from kemba.plant.simulation.simulate import STEP, Simulated, run
from kemba.plant.simulation.start import lowest_foot
from kemba.plant.stepping.arrays import Array
from kemba.trajectory import Trajectory

PERIOD = 1e-3  # s; the controller's rate (paper, IV-B)


@dataclass(frozen=True)
class Gains:
    """K_p [N.m.rad-1] and K_d [N.m.s.rad-1] of eq. 10; the paper does not give them."""

    K_p: float = 150.0
    K_d: float = 4.0


@dataclass(frozen=True)
class Execution:
    """An executed controller table: what happened, and the impacts. `lead` [s] is the time by
    which the table starts before the plan."""

    run: Simulated
    table: Trajectory
    lead: float

    @property
    def trajectory(self) -> Trajectory:
        """The motion, in the clock of the controller."""
        return self.run.trajectory

    def against(self, model: Model, plan: Trajectory) -> Replay:
        """The execution compared with the plan it came from."""
        return judge(model, plan, plan.time - plan.time[0] + self.lead, self.run)


def execute(
    controller: Trajectory | str | Path,
    model: Model,
    gains: Gains | None = None,
    step: float = STEP,
    extra: float = 0.0,
    start: dict[str, float] | None = None,
    dead_time: bool = True,
    valves: Mapping[str, Profile] | None = None,
    sample: float | Array = 1e-3,
) -> Execution:
    """Play a controller table (a run folder, `controller.csv`, or its trajectory) on `model`.

    The robot starts at rest in the table's first pose, changed by `start`. A robot that starts in
    the air is held until plan time 0, the end of the lead; its motion begins there. After the last
    row the last commands stay for `extra` [s]. `valves` replace the table's. Raises KembaError when
    the table lacks a column.
    """
    table = read_controller(controller)
    gains = gains or Gains(*(table.meta.get(k, v) for k, v in vars(Gains()).items()))
    profiles = {
        quantity.name: Profile.of(table.time, _column(table, quantity.name))
        for quantity in model.inputs.values()
        if quantity.binary
    }
    lead = float(table.meta.get("lead", 0.0))
    pose = {**first_row(model, table), **(start or {})}
    held = lead if lowest_foot(model, pose) > ON_GROUND else 0.0
    sent = {n: Profile(p.times - held, p.values) for n, p in {**profiles, **(valves or {})}.items()}
    feedback = hip_feedback(model, table, gains)
    commands = Commands(sent, lambda time, sense: feedback(time + held, sense), PERIOD)
    duration = float(table.time[-1] - table.time[0]) + extra - held
    if np.ndim(sample):
        sample = np.asarray(sample) - held
        sample = sample[(sample >= -SAME_TIME) & (sample <= duration + SAME_TIME)]
    done = run(model, pose, commands, duration, step, sample, dead_time)
    return Execution(_later(done, held), table, lead)


def _later(done: Simulated, held: float) -> Simulated:
    """The simulated motion with `held` [s] added to its times."""
    if not held:
        return done
    t = done.trajectory
    columns = {h: t[n] for h, n in zip(t.headers, t.names, strict=True)}
    impacts = tuple(replace(impact, time=impact.time + held) for impact in done.impacts)
    return Simulated(Trajectory(t.time + held, columns, t.meta), impacts)


def read_controller(source: Trajectory | str | Path) -> Trajectory:
    """The controller table of a run folder, a CSV file or in memory, starting at 0 s."""
    if not isinstance(source, Trajectory):
        path = Path(source)
        source = Trajectory.read(path / "controller.csv" if path.is_dir() else path)
    columns = {h: source[n] for h, n in zip(source.headers, source.names, strict=True)}
    return Trajectory(source.time - source.time[0], columns, source.meta)


def hip_feedback(model: Model, table: Trajectory, gains: Gains) -> Feedback:
    """tau = K_p (q_d - q) + K_d (w_d - w) + tau_ff within what the motors can give (eq. 10)."""
    legs = model.mechanism.legs
    motors = {
        leg: next((e for e in model.effects if isinstance(e, Motor) and e.on in (leg, None)), None)
        for leg in legs
    }
    reference = {
        leg: [_column(table, f"{leg}/hip/{symbol}") for symbol in ("q", "w", "tau")] for leg in legs
    }

    def feedback(time: float, sense: Sense) -> dict[str, float]:
        row = min(max(int(np.searchsorted(table.time, time + 1e-9)) - 1, 0), len(table) - 1)
        torques = {}
        for leg in legs:
            q_d, w_d, tau = (column[row] for column in reference[leg])
            q, w = sense[f"{leg}/hip/q"], sense[f"{leg}/hip/w"]
            tau = gains.K_p * (q_d - q) + gains.K_d * (w_d - w) + tau
            torques[f"{leg}/hip/tau"] = saturated(motors[leg], float(tau), w)
        return torques

    return feedback


def saturated(motor: Motor | None, tau: float, w: float) -> float:
    """The torque [N.m] that a motor at speed `w` [rad/s] gives when `tau` is asked."""
    if motor is None:
        return tau
    slope = motor.tau_rated / (motor.w_noload - motor.w_rated)
    high = min(motor.tau_peak, max(0.0, slope * (motor.w_noload - w)))
    low = -min(motor.tau_peak, max(0.0, slope * (motor.w_noload + w)))
    return min(max(tau, low), high)


def _column(table: Trajectory, name: str) -> np.ndarray:
    if name not in table:
        raise KembaError("controller", f"has no column '{name}'", "a table as solve writes it")
    return table[name]
