"""The plan as a table for the robot's 1 kHz controller (paper, IV-B)."""

from __future__ import annotations

import numpy as np

from kemba.model import Model
from kemba.trajectory import Trajectory

PERIOD = 1e-3  # s


def controller_table(model: Model, plan: Trajectory) -> Trajectory:
    """Hip angles, rates and torques interpolated; valves held, switched the dead time early.

    Time starts at the first command: plan time plus the lead, in which the first pose is held.
    Torques stand at the middle of the step on which they act. Valves stay exactly 0 or 1.
    """
    lead = float(np.ceil(max(max(model.timing(leg)) for leg in model.mechanism.legs) / PERIOD))
    duration = plan.time[-1] - plan.time[0]
    ticks = np.arange(int(lead + np.ceil(duration / PERIOD - 1e-9)) + 1)
    clock = plan.time[0] + (ticks - lead) * PERIOD
    columns: dict[str, np.ndarray] = {}
    states = plan.interpolate(clock)
    for leg in model.mechanism.legs:
        for symbol in ("q", "w"):
            header = f"{leg}/hip/{symbol} [rad{'.s-1' if symbol == 'w' else ''}]"
            columns[header] = states[f"{leg}/hip/{symbol}"]
        middle = 0.5 * (plan.time[1:] + plan.time[:-1])
        torque = np.interp(clock, middle, plan[f"{leg}/hip/tau"][1:])
        columns[f"{leg}/hip/tau [N.m]"] = np.where(clock < plan.time[0], 0.0, torque)
        on, off = model.timing(leg)
        for chamber in ("extend", "retract"):
            name = f"{leg}/valve/{chamber}"
            columns[f"{name} [1]"] = _early(plan.time, plan[name], clock, on, off)
    for name in ("body/x", "body/z", "body/pitch"):
        columns[f"{name} [{plan.unit(name)}]"] = states[name]
    for leg in model.mechanism.legs:
        columns[f"{leg}/piston/x [m]"] = states[f"{leg}/piston/x"]
    return Trajectory(
        ticks / round(1 / PERIOD), columns, {"kind": "controller", "lead": lead * PERIOD}
    )


def _early(
    time: np.ndarray, valve: np.ndarray, clock: np.ndarray, on: float, off: float
) -> np.ndarray:
    """A valve's command (ticks,) such that it acts as planned: value k on (t[k-1], t[k]]."""
    command, before = np.zeros(len(clock)), 0.0
    for k in range(1, len(time)):
        value = float(round(valve[k]))  # an interrupted plan may not be binary yet
        if value != before:
            start = time[k - 1] - (on if value > before else off)
            command[int(np.searchsorted(clock, start - PERIOD / 2)) :] = value
            before = value
    return command
