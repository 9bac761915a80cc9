"""Thresholds of the answer of `discover`."""

from __future__ import annotations


class DiscoverSettings:
    """When an effect is called missing, and when its answer is doubted."""

    # p-value of nothing up to which something is missing: three false alarms in a hundred clean
    # data sets (counted by benchmarks/calibration.py)
    significant = 0.03
    matters = 0.2  # an effect below this share of its size is not reported
    apart = 1.96  # sigmas by which an effect differs from none: its 95 % interval
    # length of the blocks whose signs are redrawn by the bootstrap [s]: three times the memory of
    # its coloured forces
    fine = 0.1
    searching = 0.8  # share of the time limit after which the search ends


class VerdictSettings:
    """When an answer is complete (`missing`), and when it is a part of one (`partly`)."""

    whole = 1.5  # error, in noise units, that a whole answer may leave
    whole_share = 0.2  # or share of the error beyond the noise
    # p-value of nothing from which an error that no effect explains is no chance: two of 200 clean
    # machines of benchmarks/calibration.py have p-values of 0.017 and 0.02 with errors of 1.7 and
    # 2.1 times the noise
    unexplained = 0.01
    part = 0.1  # smallest share of the error beyond the noise that a part of an answer explains
    # the same where more than `whole` is left and repeats itself, or a figure drifts
    part_of_structure = 0.5
    sure = 0.95  # probability from which an effect is sure: 95 %


class RankingSettings:
    """What the ranking says of each effect."""

    # two explanations are equivalent when their evidence differs by less [nats]: Kass and Raftery
    # 1995, 'strong' evidence begins at 3 nats
    same = 3.0
    shown = 8  # effects in the ranking: fits a screen
    # largest probability of all effects together where nothing is significant: nothing is then the
    # likeliest
    doubted = 0.5
