"""Settings of the checks before solving and of the elastic solve after a failure."""

from __future__ import annotations

from kemba.settings import Settings, setting


class Checks(Settings):
    """What refuses a task before solving, and what is given as a hint."""

    strokes: int = setting(
        3, "1", "pushes in one motion; a task that needs more energy is refused",
        "convention: no planned motion has more", decides=True,
    )  # fmt: skip
    longest_step: float = setting(
        0.05, "s", "longest step with which a valve can be timed within a push",
        "convention: a push is only a few of these long", decides=True,
    )  # fmt: skip


class PoseSearch(Settings):
    """How poses are sought in which requirements hold together."""

    tries: int = setting(
        4, "1", "starts", "convention: the standing pose and three others", decides=True
    )
    met: float = setting(
        1e-5, "SI", "slack below which a requirement counts as met",
        "derived: 10 times the certificate's tolerance", decides=True,
    )  # fmt: skip


class ElasticSolve(Settings):
    """The solve in which requirements may be violated."""

    nodes: int = setting(
        40, "1", "of its grid at most; a coarse one is enough to say what is too much",
        "convention: bounded, since it only explains", decides=True,
    )  # fmt: skip
    price: float = setting(
        100.0, "1", "of one unit of scaled slack, beside a cost of 0.01 to 10",
        "derived: above every cost of the task, so that no violation pays", decides=True,
    )  # fmt: skip
    short: float = setting(
        0.05, "1", "scaled slack (5 mm, 0.6 deg) from which a requirement is out of reach",
        "convention: above the grid's own error of some millimetres", decides=True,
    )  # fmt: skip
