"""What a jump comes to, read alike off plans, simulations and logs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kemba.plant.execution.replay import LandingSettings
from kemba.plotting.robot.machine import Machine
from kemba.trajectory import Array, Trajectory


class FlightSettings:
    """How apex and touchdown are read off a motion."""

    # a parabola is fitted to the heights this far around the highest reading [s]: 40 readings
    # average 0.3 mm of noise to 0.05 mm; the body falls 2 mm in 20 ms
    around = 0.02
    down = 3e-3  # a lower foot stands [m]: ten times the noise of the body's height


@dataclass(frozen=True)
class FlownJump:
    """Apex [m] and its time [s]; touchdown [s] and the pitch [rad] there, NaN where no foot comes
    down after the apex; whether the body ends upright. The clock is that of the motion."""

    apex: float
    apex_time: float
    touchdown: float
    pitch: float
    upright: bool


def flight_of(motion: Trajectory, machine: Machine) -> FlownJump:
    """The flight of a motion with body/z, body/pitch and every leg's hip and piston (or knee)."""
    settings = FlightSettings
    known = np.isfinite(motion["body/z"])
    time, z = motion.time[known], motion["body/z"][known]
    apex_time, apex = _peak(time, z, settings.around)
    clock = motion.time
    pitch = motion["body/pitch"] if "body/pitch" in motion else np.zeros(len(clock))
    touchdown = _touchdown(clock, _lowest_foot(motion, machine), apex_time, settings.down)
    last = float(pitch[np.isfinite(pitch)][-1])
    at = float(np.interp(touchdown, clock, pitch)) if np.isfinite(touchdown) else np.nan
    return FlownJump(apex, apex_time, touchdown, at, abs(last) <= LandingSettings.current().upright)


def _peak(time: Array, z: Array, around: float) -> tuple[float, float]:
    """Time and height of the highest point, by a parabola through the rows near it."""
    i = int(np.argmax(z))
    near = np.abs(time - time[i]) <= around
    if near.sum() < 4 or i in (0, len(z) - 1):
        return float(time[i]), float(z[i])
    c, b, a = np.polynomial.polynomial.polyfit(time[near] - time[i], z[near], 2)
    shift = float(np.clip(-b / (2 * a), -around, around)) if a < 0 else 0.0
    return float(time[i]) + shift, float(c + shift * (b + a * shift))


def _lowest_foot(motion: Trajectory, machine: Machine) -> Array:
    """Height [m] of the lowest foot above its ground (rows,)."""
    feet = [machine.height(motion, leg) for leg in machine.mechanism.legs]
    assert None not in feet  # a log of a robot has the columns
    return np.asarray(np.min(np.array(feet, dtype=float), axis=0))


def _touchdown(time: Array, foot: Array, after: float, down: float) -> float:
    """When the foot comes below `down` after it was above, later than the apex."""
    above = np.concatenate([[False], foot[:-1] > down])
    comes = np.flatnonzero(above & (foot <= down) & (time > after))
    if not len(comes):
        return float("nan")
    i = int(comes[0])
    share = (foot[i - 1] - down) / (foot[i - 1] - foot[i])
    return float(time[i - 1] + share * (time[i] - time[i - 1]))
