"""The likeliest parameters within their bounds: what is reported and written of an answer.

The mean of a linearised problem may lie where no parameter can be: an exponent of 1.57, a negative
area. Putting that one back to its bound leaves all others at what they would be beside 1.57, which
is no fit of anything. They move with it here, as far as they are correlated.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import lsq_linear

from kemba.identify.evidence.linear import is_shape
from kemba.identify.evidence.point import LinearisationPoint
from kemba.identify.evidence.spike_slab import Hypothesis
from kemba.identify.problem.problem import Array, Problem


def within_bounds(problem: Problem, point: LinearisationPoint) -> Array:
    """z (k,) of a refitted hypothesis where its density is largest within the bounds of its
    effects and of the nuisance parameters; shapes as logarithms, as in `Linear`."""
    z, covariance = point.score.z, point.score.covariance
    names = point.linear.names
    lower, upper = effect_bounds(problem, names, point.hypothesis)
    for name in problem.nuisance:
        i = names.index(name)
        lower[i], upper[i] = problem.limits(name)
    if np.all((lower <= z) & (z <= upper)):
        return z
    sd = np.sqrt(np.diag(covariance))
    root = np.linalg.cholesky(covariance / np.outer(sd, sd))
    lower, upper = (lower - z) / sd, (upper - z) / sd
    white = np.linalg.inv(root)  # of unit covariance: least squares
    found = lsq_linear(white, np.zeros(len(z)), (lower, np.maximum(upper, lower + 1e-9)))
    return np.asarray(z + sd * found.x)


def effect_bounds(
    problem: Problem, names: tuple[str, ...], hypothesis: Hypothesis
) -> tuple[Array, Array]:
    """Smallest and largest z (k,) of `names`, by the effects of a hypothesis; infinite for all that
    is no part of it."""
    lower, upper = np.full(len(names), -np.inf), np.full(len(names), np.inf)
    own = {k: p for effect in hypothesis for k, p in problem.candidates[effect].keys().items()}
    for i, name in enumerate(names):
        if name in own:
            ends = np.array([own[name].lower, own[name].upper])
            if is_shape(problem, name):
                with np.errstate(divide="ignore"):
                    ends = np.log(np.maximum(ends, 0.0))
            lower[i], upper[i] = ends
    return lower, upper
