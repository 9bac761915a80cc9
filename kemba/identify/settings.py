"""Thresholds of the answer of `discover`."""

from __future__ import annotations

from kemba.settings import BY_HAND, Settings, setting


class DiscoverSettings(Settings):
    """When an effect is called missing, and when its answer is doubted."""

    significant: float = setting(
        0.02,
        "1",
        "p-value of nothing up to which something is missing",
        "convention: one false alarm in fifty clean data sets",
        decides=True,
    )
    matters: float = setting(
        0.2,
        "1",
        "an effect below this share of its size is not reported",
        BY_HAND,
        decides=True,
    )
    matters_too: float = setting(
        0.3, "1", "the same for an effect beside a stronger one", BY_HAND, decides=True
    )
    unexplained: float = setting(
        1.3,
        "1",
        "error, in noise units, that an answer may leave without being doubted",
        BY_HAND,
        decides=True,
    )
    left: float = setting(
        0.9, "1", "share of the error that an answer may leave", BY_HAND, decides=True
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


class RankingSettings(Settings):
    """What the ranking says of each effect."""

    same: float = setting(
        3.0,
        "nats",
        "two explanations are equivalent when their evidence differs by less",
        "literature: Kass and Raftery 1995, 'strong' evidence begins at 3 nats",
        decides=True,
    )
    shown: int = setting(8, "1", "effects in the ranking", "convention: fits a screen")
    doubted: float = setting(
        0.5,
        "1",
        "largest probability of all effects together where nothing is significant",
        "convention: nothing is then the likeliest",
    )
