"""Which hypotheses the search refits."""

from __future__ import annotations

from kemba.settings import BY_HAND, Settings, setting


class SearchSettings(Settings):
    """Which hypotheses are refitted."""

    leaders: int = setting(6, "1", "effects that are refitted in a round", BY_HAND, decides=True)
    sure: int = setting(
        3, "1", "leaders that are refitted however far behind they are", BY_HAND, decides=True
    )
    sure_grown: int = setting(
        2, "1", "the same beside effects that are found already", BY_HAND, decides=True
    )
    far: float = setting(
        40.0,
        "nats",
        "other leaders are refitted when not farther behind",
        BY_HAND,
        decides=True,
    )
    # error of the model as it is, in noise units, from which another structure is refitted whatever
    # its linear evidence is
    structural = 1.3
    far_share: float = setting(
        0.7, "1", "or no farther behind than this share of the gain", BY_HAND, decides=True
    )
    promising: float = setting(
        0.5,
        "1",
        "share of the best gain with which an effect is tried again",
        BY_HAND,
        decides=True,
    )
    followed: int = setting(
        2, "1", "times that the motion is found again with the best guess", BY_HAND, decides=True
    )
    far_less: float = setting(
        0.5,
        "1",
        "share of the excess error that the likeliest effect leaves, below which another one that "
        "leaves less is followed first",
        "tuned: a quadratic damping of -62 N.s2.m-2 leaves 0.37 of what a mount of the piston "
        "leaves, which was likelier along the first motion",
        decides=True,
    )
    # times that the motion is found before a search along it, until late sensors stay as late: a
    # piston 5.2 ms late is found 3.2 ms late along the motion as it is read, 5.2 ms along the
    # second one after it
    settled = 4
    still = 0.1  # change of such a delay, in rows, at which it stays: below its 1 sigma
    largest = 10  # effects in one answer: more than any machine is expected to lack
    regrown: int = setting(
        3,
        "1",
        "times that an answer of several effects is begun again where it has led",
        BY_HAND,
        decides=True,
    )
    swapped = 2  # rounds in which effects of an answer are taken away or swapped
    leaders_grown: int = setting(
        3, "1", "effects that are refitted beside the best answer", BY_HAND, decides=True
    )
    leaders_swapped: int = setting(
        2, "1", "effects that are refitted in place of one of the answer", BY_HAND, decides=True
    )
    gain: float = setting(
        3.0, "nats", "gain from which a pair recommends its members", BY_HAND, decides=True
    )
    least: float = setting(
        0.1,
        "1",
        "size of an effect from which its secant replaces its slope",
        BY_HAND,
        decides=True,
    )
    promise = 10.0  # what slopes promise beyond a mode, from which they are [nats]
    # share of the excess error that the best effect leaves, from which they are; others grow from
    # an effect that explains more
    unexplained = 0.8
    closer = 3  # effects that are fitted anew
