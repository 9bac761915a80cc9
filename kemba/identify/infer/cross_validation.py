"""Does it hold on data it was not fitted to? Each part of the logs is predicted from the others.

Parts are runs, or quarters of runs where one run alone shows the effect that is judged: the others
say nothing of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from kemba.identify.infer.linear import (
    NULL,
    Hypothesis,
    Linear,
    SpikeSlabSettings,
    precision_factor,
)
from kemba.identify.infer.null_model import LinearisationPoint, effect_bounds
from kemba.identify.infer.search import Search
from kemba.identify.infer.windows import START, error_ratio
from kemba.identify.problem.problem import Array, Labels, Problem, Theta

# When left-out data refute an answer.
REFUTED = 2.0  # loss on left-out data, beyond its standard error, that refutes an answer [nats]
TOLERATED = 3.0  # prior sigmas by which a nominal figure may be off: three sigmas
# share, in one run, of what tells two hypotheses apart, from which quarters of runs are left
# out instead of runs
ALONE = 0.9
FREE = 1e6  # prior sigmas by which an effect may be off: no bound


@dataclass(frozen=True)
class Gain:
    """Log likelihood gained on left-out data [nats], and its standard error over their parts."""

    nats: float
    error: float

    @property
    def refuted(self) -> bool:
        """Whether left-out data speak against it, by more than their scatter."""
        return self.nats + self.error < -REFUTED

    @property
    def pays(self) -> bool:
        """Whether left-out data speak for it, by more than their scatter."""
        return self.nats > self.error


def one_part_shows(search: Search, hypothesis: Hypothesis, against: Hypothesis = NULL) -> bool:
    """Whether one part of the logs alone can tell two hypotheses apart, so that what remains
    without that part says nothing of it."""
    distances = _distances(search, hypothesis, against)
    return bool(distances.max() > ALONE * distances.sum())


def _distances(
    search: Search, hypothesis: Hypothesis, against: Hypothesis, fine: bool = False
) -> Array:
    """Squared distance (p,) of two predictions in each part: twice the gain expected there."""
    ours, theirs = (search.points[h].linear for h in (hypothesis, against))
    other = dict(zip(theirs.names, theirs.at.tolist(), strict=True))
    step = np.array([other.get(n, z) - z for n, z in zip(ours.names, ours.at, strict=True)])
    squares = np.einsum("i,bij,j->b", step, ours.gram, step)
    return np.asarray(np.bincount(folds(search, fine), squares), dtype=float)


def folds(search: Search, fine: bool) -> Labels:
    """Which blocks (b,) of the logs are left out together: runs, as a rule; `fine`: quarters."""
    parts = search.base.parts
    return np.arange(len(parts)) if fine else parts


def left_out(search: Search, hypothesis: Hypothesis, against: Hypothesis = NULL) -> Gain:
    """Gain of one hypothesis over another, row by row, each part predicted from all others."""
    fine = one_part_shows(search, hypothesis, against)
    points = (search.points[h] for h in (hypothesis, against))
    ours, theirs = (_powers(search, point, point.linear, fine) for point in points)
    return gained(0.5 * (theirs - ours), _distances(search, hypothesis, against, fine))


def window_gain(search: Search, hypothesis: Hypothesis, against: Hypothesis) -> Gain:
    """The same of the rows summed over aggregation windows."""
    fine = one_part_shows(search, hypothesis, against)
    ours, theirs = (window_powers(search, h, fine) for h in (hypothesis, against))
    return gained(0.5 * (theirs - ours), _distances(search, hypothesis, against, fine))


def gain_over_nothing(search: Search, hypothesis: Hypothesis) -> Gain:
    """Gain over nothing of the rows summed over aggregation windows, and of the nominal figures.

    Without its effects, nominal figures may move until left-out data are predicted as well: a body
    that is 2.3 prior sigmas too heavy for a payload. Their prior is knowledge as data are.
    """
    gain = window_gain(search, hypothesis, NULL)
    saved = figures_off(search, NULL) - figures_off(search, hypothesis)
    return Gain(gain.nats + saved, gain.error)


def figures_off(search: Search, hypothesis: Hypothesis) -> float:
    """How unlikely a hypothesis makes the nominal figures: half the sum of squares of what they
    are off by in its fit to all logs, in prior sigmas [nats]."""
    linear = search.points[hypothesis].linear
    off = (within_tolerance(search, linear, hypothesis) - linear.mean) / linear.width
    return 0.5 * float(np.sum(off[search.base.ranker(linear).nuisance] ** 2))


def gained(gains: Array, distances: Array) -> Gain:
    """Sum of gains (p,) [nats] of parts, and its standard error.

    That of a ratio estimator (Cochran 1977, 6.4): parts are expected to gain by the `distances`
    (p,) of predictions in them. Where all gain alike, it is the usual standard error; a swing that
    alone shows a motor's torque is no scatter beside jumps that cannot.
    """
    total, count = float(gains.sum()), len(gains)
    share = distances / distances.sum() if distances.sum() > 0 else np.full(count, 1.0 / count)
    scatter = float(np.sum((gains - share * total) ** 2))
    return Gain(total, float(np.sqrt(count / (count - 1) * scatter)) if count > 1 else 0.0)


def _powers(search: Search, point: LinearisationPoint, judged: Linear, fine: bool = False) -> Array:
    """Sum of squares (p,) of each part under the fit to all others, other effects absent."""
    linear, parts, found = point.linear, folds(search, fine), []
    for part in np.unique(parts):
        mask = parts == part
        fit = within_tolerance(search, linear.only(~mask), point.hypothesis)
        step = begun(linear, fit) - linear.at
        gram, slope, power = judged.only(mask).total
        found.append(power + 2 * slope @ step + step @ gram @ step)
    return np.array(found)


def within_tolerance(search: Search, linear: Linear, hypothesis: Hypothesis) -> Array:
    """z (k,) of the best fit with the nominal figures within their tolerance.

    Effects of the hypothesis stay within their bounds, as in a refit: a delay that ends at its
    bound would else be judged where no valve can be.
    """
    ranker = search.base.ranker(linear, spike=SpikeSlabSettings.silent)
    width = ranker.widths(hypothesis, 1.0)
    gram, slope, _ = linear.total
    shift = (linear.mean - linear.at) / width
    lower = precision_factor(gram, width)
    target = np.linalg.solve(lower, shift - width * slope)
    reach = np.where(ranker.nuisance, TOLERATED, FREE)
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
    """RMS of whitened residuals summed over aggregation windows, as `error_ratio`, each part of the
    logs predicted from all others."""
    power = float(window_powers(search, hypothesis, search.in_pieces).sum())
    return float(np.sqrt(max(power, 0.0) / search.points[hypothesis].windowed.count.sum()))


def window_powers(search: Search, hypothesis: Hypothesis, fine: bool = False) -> Array:
    """Sum of squares (p,) behind this error, of each part; `fine`: of quarters of runs."""
    point = search.points[hypothesis]
    if fine not in point.left_out:
        point.left_out[fine] = _powers(search, point, point.windowed, fine)
    return point.left_out[fine]


@dataclass(frozen=True)
class HeldOut:
    """Logs that are kept from the fit, with the noise that was learnt there.

    `plain`: along the motion that the model as it is makes of them. `found`: along the one that the
    model makes with which the search ended; only there do late sensors have their whole effect.
    """

    plain: Problem
    found: Problem

    @classmethod
    def beside(cls, logs: Problem, fitted: Problem) -> HeldOut:
        """`logs` as they are judged beside the fitted ones."""
        heard = logs.with_noise_of(fitted)
        return cls(heard, heard.relinearise(fitted.base) if fitted.base else heard)


def error(search: Search, hypothesis: Hypothesis, kept: HeldOut | None) -> float:
    """Error in units of the noise on data that the fit has not seen: the one number that sentence,
    ranking, ladder and figures show. Of the logs `kept`; without any, of left-out blocks."""
    if hypothesis == NULL and search.own:
        return error_as_it_is(search, kept)
    if kept is None:
        return left_out_error(search, hypothesis)
    return _ratio(search, kept.found, search.points[hypothesis].fit.theta)


def error_as_it_is(search: Search, kept: HeldOut | None = None) -> float:
    """Error of the model as it is along the motion that it makes of the data itself, as `compare`
    tells it; without logs `kept` of the fitted ones."""
    problem, theta = search.own or (search.problem, search.points[NULL].fit.theta)
    return _ratio(search, kept.plain if kept else problem.with_noise_of(search.problem), theta)


def _ratio(search: Search, judge: Problem, theta: Theta) -> float:
    unknown = set(judge.nuisance) - set(search.problem.nuisance)  # of sensors not seen before
    return error_ratio(judge, theta, unknown)
