"""Does it hold on data it was not fitted to? Each block of time is predicted from the others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from kemba.identify.evidence.linear import Linear
from kemba.identify.evidence.modes.bounded import effect_bounds
from kemba.identify.evidence.point import LinearisationPoint
from kemba.identify.evidence.search import Search
from kemba.identify.evidence.spike_slab import NULL, Hypothesis
from kemba.identify.evidence.windows import START
from kemba.identify.problem.problem import Array
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
    alone: float = setting(
        0.9,
        "1",
        "share of what the logs tell of an effect, in one run, from which quarters of runs are "
        "left out instead of runs",
        BY_HAND,
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
    """Log likelihood gained on left-out data [nats], and its standard error over blocks."""

    nats: float
    error: float

    @property
    def refuted(self) -> bool:
        """Whether left-out data speak against it, by more than their scatter."""
        return self.nats + self.error < -CrossValidationSettings.current().refuted

    @property
    def pays(self) -> bool:
        """Whether left-out data speak for it, by more than their scatter."""
        return self.nats > self.error


def one_part_shows(search: Search, hypothesis: Hypothesis) -> bool:
    """Whether an effect shows in one part of the logs alone, so that what remains without that part
    says nothing of it."""
    linear, parts = search.points[hypothesis].linear, search.base.division.parts
    for effect in hypothesis:
        i = linear.index(search.problem.candidates[effect].key)
        shown = np.bincount(parts, linear.gram[:, i, i])
        if shown.max() > CrossValidationSettings.current().alone * shown.sum():
            return True
    return False


def left_out(search: Search, hypothesis: Hypothesis, against: Hypothesis = NULL) -> Gain:
    """Gain of one hypothesis over another, each block predicted from all others."""
    ours = _predicted(search, search.points[hypothesis])
    theirs = _predicted(search, search.points[against])
    gains = ours - theirs
    return gained(gains)


def gained(gains: Array) -> Gain:
    """Sum of gains (b,) [nats] of blocks, and its standard error."""
    count = len(gains)
    return Gain(float(gains.sum()), float(np.sqrt(count) * gains.std(ddof=1)) if count > 1 else 0.0)


def _predicted(search: Search, point: LinearisationPoint) -> Array:
    """Log likelihood (b,) of each block under the fit to all others."""
    return -0.5 * _powers(search, point, point.linear)


def _powers(search: Search, point: LinearisationPoint, judged: Linear) -> Array:
    """Sum of squares (b,) that `judged` has of each part of the logs under the fit to all others.

    A left-out part judges the hypothesis alone: all other effects are absent, and no nominal
    figure may leave its tolerance to imitate an effect. How a log begins is taken from all blocks:
    only the first ones show it.
    """
    linear, found = point.linear, []
    for part in np.unique(search.parts):
        mask = search.parts == part
        fit = within_tolerance(search, linear.without(mask), point.hypothesis)
        step = begun(linear, fit) - linear.at
        gram, slope, power = judged.only(mask).total
        found.append(power + 2 * slope @ step + step @ gram @ step)
    return np.array(found)


def within_tolerance(search: Search, linear: Linear, hypothesis: Hypothesis) -> Array:
    """z (k,) of the best fit with the nominal figures within their tolerance.

    Effects of the hypothesis stay within their bounds, as in a refit: a delay that ends at its
    bound would else be judged where no valve can be.
    """
    settings = CrossValidationSettings.current()
    ranker = search.base.ranker(linear, spike=settings.none)
    width = ranker.widths(hypothesis, 1.0)
    gram, slope, _ = linear.total
    h = gram * np.outer(width, width) + np.eye(len(width))
    shift = (linear.mean - linear.at) / width
    lower = np.linalg.cholesky(h)
    target = np.linalg.solve(lower, shift - width * slope)
    reach = np.where(ranker.nuisance, settings.tolerated, settings.free)
    least, most = effect_bounds(search.problem, linear.names, hypothesis)
    least = np.maximum((least - linear.at) / width, shift - reach)
    most = np.minimum((most - linear.at) / width, shift + reach)
    found = lsq_linear(lower.T, target, bounds=(least, most), method="bvls")
    return np.asarray(linear.at + width * found.x)


def begun(linear: Linear, z: Array) -> Array:
    """z (k,) with the beginnings of the logs at their best for all rows; the others stay."""
    own = np.array([name.startswith(START) for name in linear.names])
    if not own.any():
        return z
    gram, slope, _ = linear.total
    weight = np.diag(linear.width[own] ** -2.0)
    there = slope[own] + gram[np.ix_(own, ~own)] @ (z - linear.at)[~own]
    pull = weight @ (linear.at - linear.mean)[own]
    found = z.copy()
    found[own] = linear.at[own] - np.linalg.solve(gram[np.ix_(own, own)] + weight, there + pull)
    return np.asarray(found)


def left_out_error(search: Search, hypothesis: Hypothesis) -> float:
    """RMS of whitened residuals summed over aggregation windows, as `error_ratio`, each block of
    time predicted from all others."""
    point = search.points[hypothesis]
    power = float(left_out_powers(search, hypothesis).sum())
    return float(np.sqrt(max(power, 0.0) / point.windowed.count.sum()))


def left_out_powers(search: Search, hypothesis: Hypothesis) -> Array:
    """Sum of squares (b,) behind this error, of each block."""
    point = search.points[hypothesis]
    return _powers(search, point, point.windowed)
