"""A hypothesis with the slopes that hold where it fits best: what intervals are taken from.

A search judges every hypothesis with the slopes of the model as it is. They are those of edges at
the times where that model has them. With valves that open 2 ms later, a lag of a hose acts 2 ms
later, too: along slopes at the old place, the two look like different things, and an interval of
the delay is too narrow and may lie wrong. So slopes are taken anew at the mode, a few times.
"""

from __future__ import annotations

import numpy as np

from kemba.identify.evidence.linear import is_shape
from kemba.identify.evidence.null_model import Baseline
from kemba.identify.evidence.point import LinearisationPoint
from kemba.settings import BY_HAND, Settings, setting


class SettledSettings(Settings):
    """How often slopes are taken anew."""

    rounds: int = setting(
        3,
        "1",
        "times that slopes are taken anew at the mode",
        "tuned: nine delays of 2 to 3 ms beside hose lags of 0.2 to 0.6 ms need two or three",
    )
    still: float = setting(
        0.5,
        "1",
        "change of every named effect, in its sigmas, at which no more are needed",
        BY_HAND,
    )


def settled(base: Baseline, point: LinearisationPoint) -> LinearisationPoint:
    """The refitted hypothesis of `point`, judged with slopes of every effect at its own mode.

    Where the motion depends on the model, slopes are those of the refitted hypothesis alone.
    """
    settings, problem, names = SettledSettings.current(), base.problem, point.linear.names
    own = [names.index(problem.candidates[effect].key) for effect in point.hypothesis]
    for _ in range(1 if problem.moves else settings.rounds):
        theta = point.mode.theta
        slopes = problem.jacobian(theta, names)
        for i, name in enumerate(names):
            if is_shape(problem, name):
                slopes[:, i] *= theta[name]
        before, point = point.score.z, base.judged(point.hypothesis, point.fit, names, slopes)
        sd = np.sqrt(np.diag(point.score.covariance))
        if np.all(np.abs(point.score.z - before)[own] < settings.still * sd[own]):
            break
    return point
