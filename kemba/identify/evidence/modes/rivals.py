"""Nothing and its rivals, each at its best fit and by slopes taken there.

Where nothing fits by figures that nobody would believe, or slopes promise more than a mode shows,
or effects gain little, it is not enough to look from one place: each of them is fitted anew, from
its own mode and from the best fit of the others.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from kemba.identify.evidence.linear import names_of, slopes_at, within
from kemba.identify.evidence.modes.shared import SharedSettings
from kemba.identify.evidence.modes.thorough import Best, ThoroughFit
from kemba.identify.evidence.null_model import Baseline
from kemba.identify.evidence.point import LinearisationPoint
from kemba.identify.evidence.refit import Fit, Frozen, refit
from kemba.identify.evidence.spike_slab import NULL, Hypothesis
from kemba.identify.problem.problem import Problem, Theta
from kemba.settings import Settings, setting


class RivalsSettings(Settings):
    """Where fits of effects begin."""

    shares: tuple[float, ...] = setting(
        (0.3, 0.6, 1.2, 2.4),
        "1",
        "sizes, in those of the catalogue, with the model as its file says",
        "convention: each twice the one before",
    )


Points = Mapping[Hypothesis, LinearisationPoint]


def promised(base: Baseline, point: LinearisationPoint) -> float:
    """What slopes say the cost of a mode can still fall by [nats]."""
    linear = point.mode.linear
    weight = base.ranker(linear).widths(point.hypothesis, 1.0) ** -2.0
    gram, slope, power = linear.total
    off = linear.mean - linear.at
    pull = weight * off - slope
    step = np.linalg.solve(gram + np.diag(weight), pull)
    return point.mode.cost - 0.5 * float(power + weight @ off**2 - pull @ step)


def fitted_anew(base: Baseline, points: Points) -> dict[Hypothesis, Best]:
    """The best fits of these points' hypotheses; those of effects also begin at the usual nominal
    figures, from which the fits so far may be far."""
    problem = base.problem
    fits = {h: ThoroughFit(problem, h, point.linear) for h, point in points.items()}
    found = {NULL: fits[NULL].found(points[NULL].mode.theta)}
    for hypothesis in filter(None, fits):
        own = points[hypothesis].mode.theta
        starts = [own, _beside(problem, found[NULL].theta, hypothesis, own)]
        found[hypothesis] = fits[hypothesis].best(starts)
        usual = fits[hypothesis].best(_usual(problem, hypothesis))
        found[hypothesis] = min(found[hypothesis], usual, key=lambda best: best.cost)
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


def _silent(problem: Problem, hypothesis: Hypothesis, theta: Theta) -> Fit:
    """The fit of a hypothesis alone, begun at its best fit with a little of all other effects."""
    figures = tuple(problem.nuisance)
    return refit(problem, hypothesis, theta, Frozen(figures, problem.jacobian(theta, figures)))


def _usual(problem: Problem, hypothesis: Hypothesis) -> Iterator[dict[str, float]]:
    """The model as its file says, with one effect of many sizes."""
    (effect,) = hypothesis
    candidate = problem.candidates[effect]
    for share in RivalsSettings.current().shares:
        for sign in (1.0, -1.0) if candidate.lead.signed else (1.0,):
            yield within(problem.candidates, candidate.typical(sign * share))


def _beside(problem: Problem, theta: Theta, hypothesis: Hypothesis, own: Theta) -> dict[str, float]:
    """Theta with the effects of a hypothesis as `own` has them."""
    keys = {k for effect in hypothesis for k in tuple(problem.candidates[effect].keys())}
    kept = {k: v for k, v in theta.items() if k not in keys}
    return kept | {k: v for k, v in own.items() if k in keys}
