"""Nominal figures that a model moves too far, and effects that may stand behind them.

An effect that is like some nominal figures (fast valves and wide orifices) hides in them: the
model without it fits almost as well, with figures that nobody would believe. Slopes there say
nothing of the effect with the figures where they belong, since predictions bend with both.
"""

from __future__ import annotations

import numpy as np

from kemba.identify.evidence.linear import estimate
from kemba.identify.evidence.point import LinearisationPoint
from kemba.identify.evidence.spike_slab import Hypothesis
from kemba.identify.problem.problem import Flags, Problem


class StrainSettings:
    """When nominal figures are not believed."""

    # prior sigmas from which a nominal figure is not believed: chance moves one of twenty figures
    # so far in one data set of eight hundred
    far = 4.0
    tried = 3  # effects that are tried in place of such figures


def strained(point: LinearisationPoint, problem: Problem) -> Flags:
    """Which of a point's parameters (k,) are nominal figures that are not believed."""
    linear, far = point.linear, StrainSettings.far
    figure = np.array([name in problem.nuisance for name in linear.names])
    return np.asarray(figure & (np.abs(linear.at - linear.mean) > far * linear.width))


def stand_ins(point: LinearisationPoint, problem: Problem) -> dict[Hypothesis, dict[str, float]]:
    """Single effects that change predictions most as these figures do, and where their refits
    begin: the figures back at their usual values, the effect in their place."""
    linear, moved = point.linear, strained(point, problem)
    if not moved.any():
        return {}
    gram, _, _ = linear.total
    shift = gram[:, moved] @ (linear.at - linear.mean)[moved]  # of every slope with the change
    keys = {name: linear.index(c.key) for name, c in problem.candidates.items()}
    alike = {n: abs(shift[i]) / max(np.sqrt(gram[i, i]), 1e-12) for n, i in keys.items()}
    found: dict[Hypothesis, dict[str, float]] = {}
    for name in sorted(alike, key=lambda n: -alike[n])[: StrainSettings.tried]:
        z, i = np.where(moved, linear.mean, linear.at), keys[name]
        z[i] = linear.mean[i] + shift[i] / gram[i, i]
        found[(name,)] = estimate(problem, linear, z)
    return found
