"""What one hypothesis found, every other begins from as well.

An edge of a valve falls between two readings, and the residual has a step where it crosses one. So
a hypothesis may end in a poor minimum and lose more by that than its effects gain. The best mode
that any hypothesis found shows where all others fit better, too.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from kemba.errors import KembaError
from kemba.identify.evidence.modes.small_effects import cost_at
from kemba.identify.evidence.point import LinearisationPoint
from kemba.identify.evidence.spike_slab import Hypothesis
from kemba.identify.problem.problem import Problem, Theta

Points = Mapping[Hypothesis, LinearisationPoint]


class SharedSettings:
    """When a hypothesis is judged again."""

    # cost that a beginning must save [nats]: Kass and Raftery 1995, less is no strong evidence
    least = 3.0


def better_beginnings(
    problem: Problem, points: Points, best: LinearisationPoint
) -> dict[Hypothesis, dict[str, float]]:
    """Hypothesis -> theta from which its mode is to be sought again, where it costs less: the mode
    of `best`, as it is, or with the hypothesis's own effects beside or instead of its effects."""
    found = {}
    for hypothesis, point in points.items():
        theta, own = best.mode.theta, point.mode.theta
        bare = without(problem, theta, best.hypothesis)
        beside = [with_own(problem, base, hypothesis, own) for base in (theta, bare)]
        starts = [theta, *beside]
        costs = [_cost(problem, point, start) for start in starts]
        if min(costs) < point.mode.cost - SharedSettings.least:
            found[hypothesis] = dict(starts[int(np.argmin(costs))])
    return found


def without(problem: Problem, theta: Theta, hypothesis: Hypothesis) -> dict[str, float]:
    """Theta without the parameters of a hypothesis."""
    own = _keys(problem, hypothesis)
    return {k: v for k, v in theta.items() if k not in own}


def with_own(
    problem: Problem, theta: Theta, hypothesis: Hypothesis, own: Theta
) -> dict[str, float]:
    """Theta with the parameters of a hypothesis as `own` has them."""
    keys = _keys(problem, hypothesis)
    return without(problem, theta, hypothesis) | {k: v for k, v in own.items() if k in keys}


def _keys(problem: Problem, hypothesis: Hypothesis) -> set[str]:
    return {key for effect in hypothesis for key in tuple(problem.candidates[effect].keys())}


def _cost(problem: Problem, point: LinearisationPoint, theta: Theta) -> float:
    """Cost of theta under the hypothesis of `point`, as `Mode.cost`."""
    try:
        r = problem.residual(theta)
    except KembaError:
        return np.inf  # nothing can be simulated there
    return cost_at(problem, point.hypothesis, theta, r, point.linear)
