"""What a jump comes to, read alike off plans, simulations and logs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kemba.events import MEASURED, read
from kemba.plotting.robot.machine import Machine
from kemba.trajectory import Trajectory


@dataclass(frozen=True)
class FlownJump:
    """Apex [m]; the touchdown after it [s] and the pitch [rad] there, NaN where no foot comes down.
    The clock is that of the motion."""

    apex: float
    touchdown: float
    pitch: float


def flight_of(motion: Trajectory, machine: Machine) -> FlownJump:
    """The highest flight of a motion with body/z, body/pitch and every leg's hip and piston (or
    knee)."""
    feet = machine.feet(motion)
    assert feet is not None  # a log of a robot has these columns
    course = read(feet, MEASURED)
    if not np.isfinite(course.landing):
        return FlownJump(course.top[1], np.nan, np.nan)
    pitch = motion.get("body/pitch", np.zeros(len(motion)))
    return FlownJump(
        course.top[1], course.landing, float(np.interp(course.landing, motion.time, pitch))
    )
