"""Nothing and its rivals, each at its best fit and by slopes taken there.

Where nothing fits by figures that nobody would believe, or slopes promise more than a mode shows,
or effects gain little, it is not enough to look from one place: each of them is fitted anew, from
its own mode and from the best fit of the others.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from kemba.identify.evidence.linear import names_of, slopes_at
from kemba.identify.evidence.modes.shared import SharedSettings
from kemba.identify.evidence.modes.thorough import Best, ThoroughFit
from kemba.identify.evidence.null_model import Baseline
from kemba.identify.evidence.point import LinearisationPoint
from kemba.identify.evidence.refit import Frozen, refit
from kemba.identify.evidence.spike_slab import NULL, Hypothesis
from kemba.identify.problem.problem import Problem, Theta

Points = Mapping[Hypothesis, LinearisationPoint]
Starts = Mapping[Hypothesis, Theta]


def promised(base: Baseline, point: LinearisationPoint) -> float:
    """What slopes say the cost of a mode can still fall by [nats]."""
    linear = point.mode.linear
    weight = base.ranker(linear).widths(point.hypothesis, 1.0) ** -2.0
    gram, slope, power = linear.total
    off = linear.mean - linear.at
    pull = weight * off - slope
    step = np.linalg.solve(gram + np.diag(weight), pull)
    return point.mode.cost - 0.5 * float(power + weight @ off**2 - pull @ step)


def fitted_anew(base: Baseline, points: Points, also: Starts) -> dict[Hypothesis, Best]:
    """The best fits of these points' hypotheses; `also`: where those of effects may begin."""
    problem = base.problem
    fits = {h: ThoroughFit(problem, h, point.linear) for h, point in points.items()}
    found = {NULL: fits[NULL].found(points[NULL].mode.theta)}
    for hypothesis in filter(None, fits):
        own = points[hypothesis].mode.theta
        starts = [own, _beside(problem, found[NULL].theta, hypothesis, own)]
        starts += [also[hypothesis]] if hypothesis in also else []
        found[hypothesis] = fits[hypothesis].best(starts)
    top = min(found, key=lambda h: found[h].cost)
    for hypothesis, fit in fits.items():
        if hypothesis == top:
            continue
        start = _beside(problem, found[top].theta, hypothesis, found[hypothesis].theta)
        ahead = found[hypothesis].cost - found[top].cost
        fair = hypothesis == NULL and ahead > SharedSettings.current().least
        if fair or fit.cost(start) < found[hypothesis].cost:
            found[hypothesis] = min(found[hypothesis], fit.found(start), key=lambda b: b.cost)
    return found


def judged_anew(base: Baseline, points: Points, found: Mapping[Hypothesis, Best]) -> Points:
    """The points at these fits, with slopes of every effect there; `base` is as nothing is now."""
    problem = base.problem
    base.about(found[NULL].theta, _silent(problem, NULL, found[NULL].theta))
    new = {NULL: base.point}
    for hypothesis in filter(None, found):
        theta = found[hypothesis].theta
        fit = _silent(problem, hypothesis, theta)
        names = names_of(problem, fit.theta)
        new[hypothesis] = base.judged(
            hypothesis, fit, names, slopes_at(problem, theta, names), theta
        )
    return new


def _silent(problem: Problem, hypothesis: Hypothesis, theta: Theta):  # type: ignore[no-untyped-def]
    """The fit of a hypothesis alone, begun at its best fit with a little of all other effects."""
    figures = tuple(problem.nuisance)
    return refit(problem, hypothesis, theta, Frozen(figures, problem.jacobian(theta, figures)))


def _beside(problem: Problem, theta: Theta, hypothesis: Hypothesis, own: Theta) -> dict[str, float]:
    """Theta with the effects of a hypothesis as `own` has them."""
    keys = {k for effect in hypothesis for k in tuple(problem.candidates[effect].keys())}
    kept = {k: v for k, v in theta.items() if k not in keys}
    return kept | {k: v for k, v in own.items() if k in keys}
