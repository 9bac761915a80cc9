"""Safe motions of a robot that can be designed: swaying over planted feet.

The feet stand, the valves stay closed, the hips lean the body to and fro by a few centimetres, each
lean faster or slower than the one before. A sway is known by its ways and times alone, so that it
can be tried on the simulation before any plan is made; the task asks for the same ways at the same
times, and planning finds the torques.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from kemba.identify.design.settings import SwaySettings
from kemba.identify.problem.problem import Array
from kemba.model.model import Model
from kemba.plant.controller import PERIOD
from kemba.trajectory import Trajectory


@dataclass(frozen=True)
class Sway:
    """Leans of the hips by `angle` [rad] to either side in turn, `leans` of them in `duration` [s].

    `pace`: how much longer each lean lasts than the one before; below 1 they become faster.
    """

    angle: float
    leans: int
    duration: float
    pace: float

    @property
    def ends(self) -> Array:
        """Times (leans + 1,) [s] at which the leans, and the way back, end."""
        parts = self.pace ** np.arange(self.leans + 1)
        parts[0] *= 0.7  # half the way of the others,
        parts[-1] *= 0.7  # at the same acceleration
        return np.asarray(self.duration * np.cumsum(parts) / parts.sum())

    def lean(self, times: Array) -> tuple[Array, Array]:
        """Angle [rad] and rate [rad.s-1] (m,) at `times` (m,) [s]; at rest at every turn."""
        knots = np.concatenate([[0.0], self.ends])
        ways = self.angle * np.array([0.0, *(1.0 - 2.0 * (i % 2) for i in range(self.leans)), 0.0])
        piece = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, self.leans)
        length = np.diff(knots)[piece]
        s = np.clip((times - knots[piece]) / length, 0.0, 1.0)
        way = np.diff(ways)[piece]
        angle = ways[piece] + way * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        return angle, way * 30.0 * s**2 * (1.0 - s) ** 2 / length


def controller(model: Model, sway: Sway) -> Trajectory:
    """The controller's table that sways a robot from its standing pose by its hip gains alone."""
    settle = SwaySettings.hold
    times = np.arange(round((settle + sway.duration) / PERIOD) + 1) * PERIOD - settle
    angle, rate = sway.lean(np.clip(times, 0.0, None))
    columns: dict[str, Array] = {}
    for leg in model.mechanism.legs:
        pose = model.mechanism.standing[f"{leg}/hip/q"]
        columns[f"{leg}/hip/q [rad]"], columns[f"{leg}/hip/w [rad.s-1]"] = pose + angle, rate
        columns[f"{leg}/hip/tau [N.m]"] = np.zeros(len(times))
        for valve in ("extend", "retract"):
            columns[f"{leg}/valve/{valve} [1]"] = np.zeros(len(times))
    return Trajectory(times, columns, {"kind": "controller", "lead": settle})


def task(model: Model, name: str, sway: Sway, done: Trajectory, notes: str) -> dict[str, Any]:
    """The task of a sway that was simulated as `done`: the same ways at the same times."""
    settings = SwaySettings
    nodes = max(round(settings.nodes * sway.duration), settings.fewest)
    leg = next(iter(model.mechanism.legs))
    still = {"rest": True, "body/x": "0 m", "body/pitch": "0 deg", "*/foot/z": "0 m"}
    hip = float(model.mechanism.standing[f"{leg}/hip/q"])
    goals = {}
    for i, end in enumerate(sway.ends[:-1]):
        way = float(np.interp(end, done.time, done["body/x"]))
        at = float(round(end / sway.duration * nodes) / nodes)
        goals[f"lean_{i + 1}"] = {"quantity": "body/x", "at": at, "equals": f"{1e3 * way:.1f} mm"}
    pose = {"*/piston/x": "0 m", f"{leg}/hip/q": f"{hip:.4f} rad", "settled": True}
    return {
        "name": "sway",
        "notes": notes,
        "model": name,
        "duration": f"{sway.duration:.3f} s",
        "nodes": nodes,
        "hold": f"{settings.hold:g} s",
        "start": {**still, **pose},
        "end": still,
        "bounds": {
            "*/foot/z": {"at_most": "0 m"},
            "*/piston/x": {"at_most": "0 m"},
            "*/valve/*": {"at_most": 0},
            "*/knee/z": {"at_least": f"{1e3 * settings.knee:g} mm"},
        },
        "goals": goals,
        "cost": {"torque_squared": 1},
    }
