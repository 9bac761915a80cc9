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
    sample: int = setting(20000, "1", "rows of noise from which its colour is learnt", BY_HAND)
    rows: float = setting(1000.0, "Hz", "rows per second of the simulated logs", BY_HAND)
    coarse: float = setting(500.0, "Hz", "the same while the best test is looked for", BY_HAND)
    tests: int = setting(12, "1", "most tests of one rig that are simulated to judge it", BY_HAND)
    clear: float = setting(
        5.0,
        "nats",
        "evidence that settles a question",
        "literature: Kass and Raftery 1995, 'very strong' evidence begins at 5 nats",
    )
    repeats: int = setting(10, "1", "most runs of one motion", "convention: an afternoon")
    rivals: int = setting(4, "1", "effects that are to be told apart", "convention: few")


class SeparationSettings:
    """How evidence between rivals is predicted."""

    steps = 3  # steps of the fit of a rival


class RigCourseSettings(Settings):
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
    most_laps: int = setting(3, "1", "most times that it goes through them", BY_HAND)
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


class DesignSearchSettings(Settings):
    """The search for the best test: differential evolution."""

    members: int = setting(16, "1", "tests of each generation", BY_HAND)
    generations: int = setting(3, "1", "generations after the first", BY_HAND)
    seed: int = setting(1, "1", "seed of the search", "convention: the same answer every time")
    budget: float = setting(
        60.0, "s", "time after which no new test is tried", "convention: a user waits one minute"
    )


class SwaySettings(Settings):
    """What a robot may do in a designed motion."""

    least: float = setting(0.03, "rad", "smallest lean of the hips", BY_HAND)
    most: float = setting(0.25, "rad", "largest lean of the hips", "convention: 4 cm of the body")
    acceleration: float = setting(
        8.0,
        "m.s-2",
        "largest acceleration of the body",
        "tuned: feet of the shipped robot slip at about 10",
    )
    leans: int = setting(6, "1", "most leans", BY_HAND)
    shortest: float = setting(0.5, "s", "shortest sway", BY_HAND)
    longest: float = setting(
        0.9, "s", "longest sway", "tuned: plans of up to so long replay without feedback"
    )
    pace: float = setting(1.5, "1", "most by which a lean is longer than the one before", BY_HAND)
    hold: float = setting(0.3, "s", "rest before the motion", "convention: as the shipped tasks")
    nodes: int = setting(50, "1", "nodes of the task per second", "convention: steps of 20 ms")
    fewest: int = setting(30, "1", "fewest nodes of the task", BY_HAND)
    knee: float = setting(0.02, "m", "least height of the knees", "convention: as the hop")
    slip: float = setting(
        2e-3, "m", "way of a foot that counts as slipping", "convention: boom noise, 6 sigma"
    )
    load: float = setting(
        0.15, "1", "least load of a foot, as a share of half the weight", "convention: margin"
    )
    effort: float = setting(
        0.8, "1", "largest torque of a hip, as a share of its peak", "convention: margin"
    )
    tried: int = setting(12, "1", "motions that are tried", "convention: a minute")
    least_tried: int = setting(6, "1", "motions that are tried on the slowest machine", BY_HAND)
    rows: float = setting(500.0, "Hz", "rows per second of the simulated logs", BY_HAND)
