"""The robot's controller within the kernel: torques that follow a table (paper, eq. 10)."""

from __future__ import annotations

from typing import NamedTuple

from kemba.plant.kernel.jit import part
from kemba.plant.kernel.machine import Memory, State
from kemba.plant.stepping.arrays import Array


class Law(NamedTuple):
    """tau = K_p (q_d - q) + K_d (w_d - w) + tau_ff of some joints, within what the motors give.

    By joint: `angle` and `speed`, places in `State.y`; `torque`, place in x; `limits` (joints, 3),
    see `limited`. `wanted` (marks, joints, 3): q_d, w_d, tau_ff at every mark of the schedule.
    """

    K_p: float
    K_d: float
    angle: Array
    speed: Array
    torque: Array
    limits: Array
    wanted: Array


@part
def control(law: Law, k: Memory, now: State, mark: int) -> None:
    """Set the torques at a mark."""
    for i in range(len(law.torque)):
        q, w = now.y[law.angle[i]], now.y[law.speed[i]]
        q_d, w_d, ahead = law.wanted[mark, i, 0], law.wanted[mark, i, 1], law.wanted[mark, i, 2]
        tau = law.K_p * (q_d - q) + law.K_d * (w_d - w) + ahead
        k.x[law.torque[i]] = limited(tau, w, law.limits[i])


@part
def limited(tau: float, w: float, limits: Array) -> float:
    """The torque [N.m] that a motor at speed `w` [rad/s] gives when `tau` is asked.

    `limits`: peak torque [N.m], speed without load [rad/s], and the slope [N.m.s] at which torque
    falls with speed.
    """
    peak, noload, slope = float(limits[0]), float(limits[1]), float(limits[2])
    high = min(peak, max(0.0, slope * (noload - w)))
    low = -min(peak, max(0.0, slope * (noload + w)))
    return min(max(tau, low), high)
