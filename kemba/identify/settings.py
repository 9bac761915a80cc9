"""Thresholds of the answer of `discover`."""

from __future__ import annotations

from kemba.settings import BY_HAND, Settings, setting


class DiscoverSettings(Settings):
    """When an effect is called missing, and when its answer is doubted."""

    significant: float = setting(
        0.03,
        "1",
        "p-value of nothing up to which something is missing",
        "convention: three false alarms in a hundred clean data sets (counted by "
        "benchmarks/calibration.py)",
        decides=True,
    )
    matters: float = setting(
        0.2,
        "1",
        "an effect below this share of its size is not reported",
        BY_HAND,
        decides=True,
    )
    apart: float = setting(
        1.96, "1", "sigmas by which an effect differs from none", "convention: its 95 % interval"
    )
    matters_too: float = setting(
        0.3, "1", "the same for an effect beside a stronger one", BY_HAND, decides=True
    )
    fine: float = setting(
        0.1,
        "s",
        "length of the blocks whose signs are redrawn by the bootstrap",
        "tuned: by hand on the twin of tests/twin, no benchmark; three times the memory of its "
        "coloured forces",
        decides=True,
    )
    searching: float = setting(
        0.8, "1", "share of the time limit after which the search ends", BY_HAND
    )


class VerdictSettings(Settings):
    """When an answer is complete (`missing`), and when it is a part of one (`partly`)."""

    whole: float = setting(
        1.5, "1", "error, in noise units, that a whole answer may leave", BY_HAND, decides=True
    )
    whole_share: float = setting(
        0.2, "1", "or share of the error beyond the noise", BY_HAND, decides=True
    )
    unexplained: float = setting(
        0.01,
        "1",
        "p-value of nothing from which an error that no effect explains is no chance",
        "tuned: two of 200 clean machines of benchmarks/calibration.py have p-values of 0.017 and "
        "0.02 with errors of 1.7 and 2.1 times the noise",
        decides=True,
    )
    part: float = setting(
        0.1,
        "1",
        "smallest share of the error beyond the noise that a part of an answer explains",
        BY_HAND,
        decides=True,
    )
    part_of_structure: float = setting(
        0.5,
        "1",
        "the same where more than `whole` is left and repeats itself, or a figure drifts",
        BY_HAND,
        decides=True,
    )
    where_it_acts: float = setting(
        0.01,
        "1",
        "share of the squared excess left where an answer acts, up to which it is a part however "
        "much is left elsewhere",
        "tuned: on the 20 cases of benchmarks/blind/bench.py outside the catalogue wrong answers "
        "left 0.019 to 1.3, and a right cushion beside another error 0.002",
        decides=True,
    )
    sure: float = setting(
        0.95, "1", "probability from which an effect is sure", "convention: 95 %", decides=True,
        at_most=0.999,
    )  # fmt: skip


class RankingSettings(Settings):
    """What the ranking says of each effect."""

    same: float = setting(
        3.0,
        "nats",
        "two explanations are equivalent when their evidence differs by less",
        "literature: Kass and Raftery 1995, 'strong' evidence begins at 3 nats",
        decides=True,
    )
    shown = 8  # effects in the ranking: fits a screen
    # largest probability of all effects together where nothing is significant: nothing is then the
    # likeliest
    doubted = 0.5
