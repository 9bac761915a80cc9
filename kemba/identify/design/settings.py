"""Figures of the design of experiments."""

from __future__ import annotations

from kemba.settings import BY_HAND, Settings, setting


class ExperimentSettings(Settings):
    """The sensors of a rig, and when a question is settled."""

    force_noise: float = setting(
        1.0, "N", "noise of the force sensor", "convention: a usual transducer of a rig"
    )
    position_noise: float = setting(
        1e-5, "m", "noise of the position sensor", "convention: a usual one of a rig"
    )
    unexplained: float = setting(
        0.5,
        "N",
        "force that not even a good model explains",
        "convention: half the noise of the sensor; without it slow errors would be averaged away",
    )
    memory: float = setting(
        0.03, "s", "time in which that force changes", "convention: that of the fastest rise times"
    )
    rows: float = setting(1000.0, "Hz", "rows per second of the simulated logs", BY_HAND)
    coarse: float = setting(500.0, "Hz", "the same while the best test is looked for", BY_HAND)
    tests: int = setting(12, "1", "most tests of one rig that are simulated to judge it", BY_HAND)
    clear: float = setting(
        5.0,
        "nats",
        "evidence that settles a question",
        "literature: Kass and Raftery 1995, 'very strong' evidence begins at 5 nats",
    )
    rivals: int = setting(4, "1", "effects that are to be told apart", "convention: few")


class CourseSettings(Settings):
    """What a designed test of a rig may do."""

    longest: float = setting(2.0, "s", "longest log of a designed test", "convention: short")
    shortest: float = setting(
        0.3,
        "s",
        "shortest log of a designed test",
        "derived: chambers fill and vent three times, at the slowest rise time of Table I",
    )
    share: float = setting(
        0.5, "1", "its log time as a share of that of the best standard test", "convention: half"
    )
    places: int = setting(9, "1", "places that the rod goes through", BY_HAND)
    pulses: int = setting(3, "1", "pulses of each valve", BY_HAND)
    dwell: float = setting(
        0.02,
        "s",
        "shortest time between two switchings of a valve",
        "derived: twice the dead time of the paper's valves",
    )
    fastest: float = setting(
        1.2, "m.s-1", "highest speed of the rod", "convention: that of the fastest standard test"
    )


class SearchSettings(Settings):
    """The search for the best test: differential evolution."""

    members: int = setting(16, "1", "tests of each generation", BY_HAND)
    generations: int = setting(4, "1", "generations after the first", BY_HAND)
    seed: int = setting(1, "1", "seed of the search", "convention: the same answer every time")
    budget: float = setting(
        60.0, "s", "time after which no new test is tried", "convention: a user waits one minute"
    )
