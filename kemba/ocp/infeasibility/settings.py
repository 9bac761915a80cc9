"""Settings of the checks before solving and of the elastic solve after a failure."""

from __future__ import annotations

from kemba.settings import Settings, setting


class Checks(Settings):
    """What refuses a task before solving, and what is told as a hint."""

    heavy: float = setting(
        0.2, "1", "payload of all that is lifted, from which it is told as a cause",
        "convention: less explains little of a missing height",
    )  # fmt: skip
    strokes: int = setting(
        3, "1", "pushes in one motion; a task that needs more energy is refused",
        "convention: no planned motion has more", decides=True,
    )  # fmt: skip
    longest_step: float = setting(
        0.05, "s", "longest step with which a valve can be timed within a push",
        "convention: a push is only a few of these long", decides=True,
    )  # fmt: skip
    forward: float = setting(
        0.01, "m", "way forward that needs friction of the ground",
        "convention: less is within the legs' swing",
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
    tol: float = setting(
        1e-8, "1", "IPOPT's tolerance", "derived: far below the slack that counts as met"
    )
    iterations: int = setting(
        150, "1", "of one start", "convention: a pose that takes longer counts as not found"
    )
    still: float = setting(
        1e-6, "1", "weight of squared rates, so that they are determined",
        "convention: small beside one unit of slack",
    )  # fmt: skip
    spread: float = setting(
        3.0, "1", "times the scale of a coordinate: standard deviation of further starts",
        "convention: far from the standing pose, within joint ranges",
    )  # fmt: skip


class ElasticSolve(Settings):
    """The solve in which requirements may give way."""

    budget: float = setting(30.0, "s", "time limit", "convention: a user waits no longer for it")
    nodes: int = setting(
        40, "1", "of its grid at most; a coarse one is enough to say what is too much",
        "convention: bounded, since it only explains", decides=True,
    )  # fmt: skip
    iterations: int = setting(
        500, "1", "of one solve", "convention: bounded, since it only explains"
    )
    price: float = setting(
        100.0, "1", "of one unit of scaled slack, beside a cost of 0.01 to 10",
        "derived: above every cost of the task, so that nothing gives way for it", decides=True,
    )  # fmt: skip
    cheap: float = setting(
        0.01, "1", "factor on the task's costs", "convention: far below the price of slack"
    )
    short: float = setting(
        0.05, "1", "scaled slack (5 mm, 0.6 deg) from which a requirement is out of reach",
        "convention: above the grid's own error of some millimetres", decides=True,
    )  # fmt: skip
    room: float = setting(
        0.1, "1", "slack of the start guess", "convention: off the bounds, in the range of answers"
    )


class Leaning(Settings):
    """When a plan counts as being at a limit of the robot."""

    near: float = setting(0.99, "1", "part of the stroke that counts as all", "convention: 1 %")
    often: float = setting(
        0.3, "1", "part of the steps for which a limit must hold to be told",
        "convention: a third of the motion",
    )  # fmt: skip
    grip: float = setting(
        0.02, "1", "of body weight: a foot with less normal force does not stand",
        "convention: 2 %, far above the pairs' relaxation",
    )  # fmt: skip
    slides: float = setting(0.02, "m.s-1", "slip speed of a sliding foot", "convention: 2 cm/s")
    throughout: float = setting(
        0.95, "1", "part of the push that counts as all of it", "convention: all but a step"
    )
    mostly: float = setting(
        0.6, "1", "part of the push for which open valves are told", "convention: above half"
    )
    peak: float = setting(0.95, "1", "part of the peak torque that counts", "convention: 5 %")
    step: float = setting(0.02, "1", "relative distance to a step's bound", "convention: 2 %")
    steps: float = setting(
        0.8, "1", "part of the steps at a bound that is told", "convention: nearly all"
    )
