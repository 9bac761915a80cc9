"""Which hypotheses the search refits."""

from __future__ import annotations


class SearchSettings:
    """Which hypotheses are refitted."""

    leaders = 6  # effects that are refitted in a round
    sure = 3  # leaders that are refitted however far behind they are
    sure_grown = 2  # the same beside effects that are found already
    far = 40.0  # other leaders are refitted when not farther behind [nats]
    # error of the model as it is, in noise units, from which another structure is refitted whatever
    # its linear evidence is
    structural = 1.3
    far_share = 0.7  # or no farther behind than this share of the gain
    promising = 0.5  # share of the best gain with which an effect is tried again
    followed = 2  # times that the motion is found again with the best guess
    # times that the motion is found before a search along it, until late sensors stay as late: a
    # piston 5.2 ms late is found 3.2 ms late along the motion as it is read, 5.2 ms along the
    # second one after it
    settled = 4
    still = 0.1  # change of such a delay, in rows, at which it stays: below its 1 sigma
    largest = 10  # effects in one answer: more than any machine is expected to lack
    regrown = 3  # times that an answer of several effects is begun again where it has led
    swapped = 2  # rounds in which effects of an answer are taken away or swapped
    leaders_grown = 3  # effects that are refitted beside the best answer
    leaders_swapped = 2  # effects that are refitted in place of one of the answer
    least = 0.1  # size of an effect from which its secant replaces its slope
