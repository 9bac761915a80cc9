"""A hypothesis with the slopes that hold where it fits best: what intervals are taken from.

A search judges every hypothesis with the slopes of the model as it is. They are those of edges at
the times where that model has them. With valves that open 2 ms later, a lag of a hose acts 2 ms
later, too: along slopes at the old place, the two look like different things, and an interval of
the delay is too narrow and may lie wrong. So slopes are taken anew at the mode, a few times.
"""

from __future__ import annotations

from copy import copy

import numpy as np

from kemba.errors import KembaError
from kemba.identify.evidence.linear import slopes_at
from kemba.identify.evidence.null_model import Baseline
from kemba.identify.evidence.point import LinearisationPoint
from kemba.identify.evidence.spike_slab import SpikeSlabSettings
from kemba.identify.problem.problem import Problem, Theta
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

    A lag that is absent there has the slope of a lag of a whole row. So the mode is sought once
    more, from all absent lags at what a model's usual imperfection allows; the likelier is taken.
    Where the motion depends on the model, slopes are those of the refitted hypothesis alone. A
    search reads what a late sensor shows off between rows, which makes valves that are early look
    different from sensors that are all late: here it does not. A search that does so, too, found a
    false formula on a clean log with every 17th row dropped (tried by hand).
    """
    base, here = copy(base), point.mode.theta
    base.problem = base.problem.in_detail()
    if base.problem.moves:
        return _from(base, point, here, 1)
    rounds = SettledSettings.current().rounds
    starts = [here] if not (lags := _lags(base.problem, here)) else [here, {**lags, **here}]
    found = [_from(base, point, start, rounds) for start in starts]
    anew = [one for one in found if one is not point]
    return max(anew, key=lambda one: one.log_evidence, default=point)


def _lags(problem: Problem, theta: Theta) -> dict[str, float]:
    """Every time that cannot be negative and is absent at theta, as large as the spike allows."""
    spike = SpikeSlabSettings.current().spike
    leads = {c.key: c.lead for c in problem.candidates.values() if len(c.keys()) == 1}
    return {
        key: max(lead.off + spike * lead.size, lead.lower)
        for key, lead in leads.items()
        if lead.unit == "s" and not lead.signed and theta.get(key, lead.off) == lead.off
    }


def _from(
    base: Baseline, point: LinearisationPoint, theta: Theta, rounds: int
) -> LinearisationPoint:
    """The hypothesis with slopes at theta, then at the mode that they lead to, until it stays; as
    far as that, where slopes lead to what cannot be predicted."""
    problem, names, still = base.problem, point.linear.names, SettledSettings.current().still
    own = [names.index(problem.candidates[effect].key) for effect in point.hypothesis]
    for _ in range(rounds):
        try:
            slopes = slopes_at(problem, theta, names)
            before = point.score.z
            point = base.judged(point.hypothesis, point.fit, names, slopes, theta)
        except KembaError:
            break
        theta, sd = point.mode.theta, np.sqrt(np.diag(point.score.covariance))
        if np.all(np.abs(point.score.z - before)[own] < still * sd[own]):
            break
    return point
