"""Does it hold on data it was not fitted to? Prediction of left-out blocks, and held-out logs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from kemba.identify.evidence.linear import Linear, estimate, linearise, time_blocks
from kemba.identify.evidence.null_model import best_fit
from kemba.identify.evidence.point import LinearisationPoint
from kemba.identify.evidence.problem import Array, Problem, Theta
from kemba.identify.evidence.search import Search
from kemba.identify.evidence.spike_slab import NULL, Hypothesis
from kemba.identify.evidence.windows import rms, windows_of
from kemba.settings import BY_HAND, Settings, setting


class CrossValidationSettings(Settings):
    """When left-out data refute an answer."""

    refuted: float = setting(
        2.0,
        "nats",
        "loss on left-out data, beyond its standard error, that refutes an answer",
        BY_HAND,
        decides=True,
    )
    tolerated: float = setting(
        3.0,
        "1",
        "prior sigmas by which a nominal figure may be off",
        "convention: three sigmas",
        decides=True,
    )
    none: float = setting(
        1e-6, "1", "width of the spike of absent effects", "convention: none, but not singular"
    )
    free: float = setting(
        1e6, "1", "prior sigmas by which an effect may be off", "convention: no bound"
    )


@dataclass(frozen=True)
class Gain:
    """Log-likelihood gained on left-out data [nats], with its standard error over blocks."""

    nats: float
    error: float

    @property
    def refuted(self) -> bool:
        """Whether left-out data speak against it, by more than their scatter."""
        return self.nats + self.error < -CrossValidationSettings.current().refuted


def left_out(search: Search, hypothesis: Hypothesis, against: Hypothesis = NULL) -> Gain:
    """Gain of one hypothesis over another, each block predicted from all others."""
    ours = _predicted(search, search.points[hypothesis])
    theirs = _predicted(search, search.points[against])
    gains = ours - theirs
    count = len(gains)
    return Gain(float(gains.sum()), float(np.sqrt(count) * gains.std(ddof=1)) if count > 1 else 0.0)


def _predicted(search: Search, point: LinearisationPoint) -> Array:
    """Log likelihood (b,) of each block under the fit to all others."""
    return -0.5 * _powers(search, point, point.linear) / search.heat


def _powers(search: Search, point: LinearisationPoint, judged: Linear) -> Array:
    """Sum of squares (b,) that `judged` has of each block under the fit to all others.

    A left-out block judges the hypothesis alone: all other effects are absent, and no nominal
    figure may leave its tolerance to imitate an effect.
    """
    linear, found = point.linear, []
    for block in range(len(linear.count)):
        mask = np.arange(len(linear.count)) == block
        step = within_tolerance(search, linear.without(mask), point.hypothesis) - linear.at
        one = judged.only(mask)
        found.append(one.power[0] + 2 * one.slope[0] @ step + step @ one.gram[0] @ step)
    return np.array(found)


def within_tolerance(search: Search, linear: Linear, hypothesis: Hypothesis) -> Array:
    """z (k,) of the best fit with the nominal figures within their tolerance."""
    settings = CrossValidationSettings.current()
    ranker = search.base.ranker(linear, floor=settings.none)
    width = ranker.widths(hypothesis, 1.0)
    gram, slope, _ = linear.total
    h = gram * np.outer(width, width) / search.heat + np.eye(len(width))
    shift = (linear.mean - linear.at) / width
    lower = np.linalg.cholesky(h)
    target = np.linalg.solve(lower, shift - width * slope / search.heat)
    reach = np.where(ranker.nuisance, settings.tolerated, settings.free)
    found = lsq_linear(lower.T, target, bounds=(shift - reach, shift + reach), method="bvls")
    return np.asarray(linear.at + width * found.x)


def predicted_error(search: Search, point: LinearisationPoint) -> float:
    """RMS of whitened residuals summed over grains, each block predicted from all others."""
    power = float(_powers(search, point, point.coarse).sum())
    return float(np.sqrt(max(power, 0.0) / point.coarse.count.sum()))


def heldout_error(problem: Problem, theta: Theta) -> float:
    """RMS of whitened residuals summed over grains on other logs; only how their runs start is
    fitted to them."""
    names = tuple(n for n in problem.nuisance if n not in theta or n.startswith("start:"))
    theta = {k: v for k, v in theta.items() if not k.startswith("start:")}
    if names:
        linear, _, _ = linearise(problem, theta, time_blocks(problem), names)
        theta = theta | estimate(problem, linear, best_fit(linear))
    return rms(windows_of(problem).sums(problem.residual(theta)))
