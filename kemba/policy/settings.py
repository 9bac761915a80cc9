"""Weights and bounds of a feedback policy."""

from __future__ import annotations

from kemba.settings import CHOSEN, Settings, setting


class PolicySettings(Settings):
    """How far a policy may go."""

    latest: int = setting(8, "ms", "by which an edge moves at most", CHOSEN, decides=True)
    added: float = setting(5.0, "N.m", "torque that is added at most", CHOSEN, decides=True)


# deviations and corrections that cost the same: of the body's place [m], velocity [m/s], pitch
# [rad] and its rate [rad/s], of a hip or knee [rad] and its rate [rad/s]
PLACE, SPEED, PITCH, PITCH_RATE, JOINT, JOINT_RATE = 0.01, 0.1, 0.01, 0.1, 0.05, 2.0
TORQUE, EDGE = (
    2.0,
    3e-3,
)  # the same: torque that is added [N.m], time by which a valve edge moves [s]
FADING = 0.1  # s; stage costs of this long count as much as those at the end
WINDOW = 8  # ticks, over which rates are estimated
# ticks before and after touchdown in which no torque is added: feet that touch a little sooner or
# later have quite other velocities
BLIND = 10
# executions from which it is learnt what to expect; of fewer nothing is learnt: more than the 14
# deviations and rates that are weighed
FEWEST = 20
FINE = 4  # instants a tick at which valves of the simulated robot may act

# how the events along an executed table are found
CLOSING = 1e-6  # m/s; a gap that closes more slowly touches without an impact
SAME = 1e-8  # s; switches nearer than this are one
BESIDE = 2e-5  # s; states are read this far from an impact: other samples move it by up to 10 us
FINER = 20  # rows within a step in which a foot leaves the ground or begins to slide
PASSES = 3  # simulations in which the samples beside impacts find their place
