"""Nothing and its rivals, each at its best fit and by slopes taken there.

Where nothing fits by figures that nobody would believe, or slopes promise more than a mode shows,
slopes at one place are no fair judge: each of them is fitted anew, from its own mode and from the
best fit of the others.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from kemba.identify.evidence.linear import names_of, slopes_at
from kemba.identify.evidence.modes.shared import SharedSettings, with_own
from kemba.identify.evidence.modes.thorough import ThoroughFit
from kemba.identify.evidence.null_model import Baseline
from kemba.identify.evidence.point import LinearisationPoint
from kemba.identify.evidence.refit import Fit, Frozen, refit
from kemba.identify.evidence.spike_slab import NULL, Hypothesis
from kemba.identify.problem.problem import Problem, Theta
from kemba.stopwatch import Stage, Tell, silent


class RivalsSettings:
    """Which fits of effects are carried on."""

    first = 5  # evaluations after which fits are compared
    kept = 3  # effects whose fits are carried on


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


def fitted_anew(
    base: Baseline, points: Points, ended: Callable[[], bool], say: Tell = silent
) -> dict[Hypothesis, Fit]:
    """The best fits of nothing and of the rivals that fit best after a few steps.

    They begin at their own modes, or at that of nothing with their effects beside it; at last from
    the best fit of any. `ended`: whether the time is over; rivals not begun by then are left out.
    `say`: told of progress.
    """
    problem, settings = base.problem, RivalsSettings
    fits = {h: ThoroughFit(problem, h, point.linear) for h, point in points.items()}
    found = {NULL: fits[NULL].found(points[NULL].mode.theta)}
    begun: dict[Hypothesis, Fit] = {}
    rivals = [h for h in fits if h]
    for number, hypothesis in enumerate(rivals, start=1):
        if begun and ended():
            break
        say(Stage(f"fitting {' + '.join(hypothesis)} anew", number, len(rivals)))
        fit, own = fits[hypothesis], points[hypothesis].mode.theta
        near = [own, with_own(problem, found[NULL].theta, hypothesis, own)]
        begun[hypothesis] = fit.found(min(near, key=fit.cost), settings.first)
    say("carrying on the best of these fits")
    for hypothesis in sorted(begun, key=lambda h: begun[h].cost)[: settings.kept]:
        best = begun[hypothesis]
        found[hypothesis] = best if ended() else fits[hypothesis].found(best.theta)
    top = min(found, key=lambda h: found[h].cost)
    for hypothesis, one in found.items():
        start = with_own(problem, found[top].theta, hypothesis, one.theta)
        fair = hypothesis == NULL and one.cost > found[top].cost + SharedSettings.least
        if hypothesis != top and (fair or fits[hypothesis].cost(start) < one.cost):
            found[hypothesis] = _better(one, fits[hypothesis].found(start))
    return found


def _better(one: Fit, other: Fit) -> Fit:
    return min(one, other, key=lambda best: best.cost)


def judged_anew(base: Baseline, points: Points, found: Mapping[Hypothesis, Fit]) -> Points:
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
