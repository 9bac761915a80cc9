"""Figures of the design of experiments."""

from __future__ import annotations


class ExperimentSettings:
    """The sensors of a rig, and when a question is settled."""

    force_noise = 1.0  # noise of the force sensor [N]: a usual transducer of a rig
    position_noise = 1e-5  # noise of the position sensor [m]: a usual one of a rig
    # force that not even a good model explains [N]: half the noise of the sensor; without it slow
    # errors would be averaged away
    unexplained = 0.5
    memory = 0.03  # time in which that force changes [s]: that of the fastest rise times
    sample = 20000  # rows of noise from which its colour is learnt
    rows = 1000.0  # rows per second of the simulated logs [Hz]
    coarse = 500.0  # the same while the best test is looked for [Hz]
    tests = 12  # most tests of one rig that are simulated to judge it
    # evidence that settles a question [nats]: Kass and Raftery 1995, 'very strong' evidence begins
    # at 5 nats
    clear = 5.0
    repeats = 10  # most runs of one motion: an afternoon
    rivals = 4  # effects that are to be told apart: few


class SeparationSettings:
    """How evidence between rivals is predicted."""

    steps = 3  # steps of the fit of a rival


class RigCourseSettings:
    """What a designed test of a rig may do."""

    longest = 2.0  # longest log of a designed test [s]: short
    # shortest log of a designed test [s]: chambers fill and vent three times, at the slowest rise
    # time of Table I
    shortest = 0.3
    share = 0.5  # its log time as a share of that of the best standard test: half
    places = 9  # places that the rod goes through
    most_laps = 3  # most times that it goes through them
    pulses = 3  # pulses of each valve
    # shortest time between two switchings of a valve [s]: twice the dead time of the paper's valves
    dwell = 0.02
    fastest = 1.2  # highest speed of the rod [m.s-1]: that of the fastest standard test


class DesignSearchSettings:
    """The search for the best test: differential evolution."""

    members = 16  # tests of each generation
    generations = 3  # generations after the first
    seed = 1  # seed of the search: the same answer every time
    budget = 60.0  # time after which no new test is tried [s]: a user waits one minute


class SwaySettings:
    """What a robot may do in a designed motion."""

    least = 0.03  # smallest lean of the hips [rad]
    most = 0.25  # largest lean of the hips [rad]: 4 cm of the body
    # largest acceleration of the body [m.s-2]: feet of the shipped robot slip at about 10
    acceleration = 8.0
    leans = 6  # most leans
    shortest = 0.5  # shortest sway [s]
    longest = 0.9  # longest sway [s]: plans of up to so long replay without feedback
    pace = 1.5  # most by which a lean is longer than the one before
    hold = 0.3  # rest before the motion [s]: as the shipped tasks
    nodes = 50  # nodes of the task per second: steps of 20 ms
    fewest = 30  # fewest nodes of the task
    knee = 0.02  # least height of the knees [m]: as the hop
    slip = 2e-3  # way of a foot that counts as slipping [m]: boom noise, 6 sigma
    load = 0.15  # least load of a foot, as a share of half the weight: margin
    effort = 0.8  # largest torque of a hip, as a share of its peak: margin
    tried = 12  # motions that are tried: a minute
    least_tried = 6  # motions that are tried on the slowest machine
    rows = 500.0  # rows per second of the simulated logs [Hz]
