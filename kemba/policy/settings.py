"""Weights and bounds of a feedback policy."""

from __future__ import annotations

from kemba.settings import CHOSEN, Settings, setting


class PolicySettings(Settings):
    """What deviations and corrections count: each unit below costs the same."""

    place: float = setting(0.01, "m", "deviation of the body's place", CHOSEN)
    speed: float = setting(0.1, "m.s-1", "deviation of the body's velocity", CHOSEN)
    pitch: float = setting(0.01, "rad", "deviation of the pitch", CHOSEN)
    pitch_rate: float = setting(0.1, "rad.s-1", "deviation of the pitch's rate", CHOSEN)
    joint: float = setting(0.05, "rad", "deviation of a hip or knee", CHOSEN)
    joint_rate: float = setting(2.0, "rad.s-1", "deviation of a joint's rate", CHOSEN)
    torque: float = setting(2.0, "N.m", "torque that the policy adds", CHOSEN)
    edge: float = setting(3e-3, "s", "time by which a valve edge moves", CHOSEN)
    fading: float = setting(
        0.1, "s", "stage costs of this long count as much as those at the end", CHOSEN
    )
    latest: int = setting(8, "ms", "by which an edge moves at most", CHOSEN, decides=True)
    added: float = setting(5.0, "N.m", "torque that is added at most", CHOSEN, decides=True)
    window: int = setting(8, "ticks", "over which rates are estimated", CHOSEN)
    blind: int = setting(
        10, "ticks", "before and after touchdown in which no torque is added: feet that touch a "
        "little sooner or later have quite other velocities", CHOSEN,
    )  # fmt: skip
    fewest: int = setting(
        20, "1", "executions from which it is learnt what to expect; of fewer nothing is learnt",
        "derived: more than the 14 deviations and rates that are weighed",
    )  # fmt: skip
    fine: int = setting(
        4, "1", "instants a tick at which valves of the simulated robot may act", CHOSEN
    )


class CourseSettings(Settings):
    """How the events along an executed table are found."""

    closing: float = setting(
        1e-6, "m.s-1", "a gap that closes more slowly touches without an impact", CHOSEN
    )
    same: float = setting(1e-8, "s", "switches nearer than this are one", CHOSEN)
    beside: float = setting(
        2e-5, "s", "states before and after an impact are read this far from it",
        "derived: other samples move an impact by up to 10 us",
    )  # fmt: skip
    finer: int = setting(
        20, "1", "rows within a step in which a foot leaves the ground or begins to slide", CHOSEN
    )
    passes: int = setting(
        3, "1", "simulations in which the samples beside impacts find their place", CHOSEN
    )
