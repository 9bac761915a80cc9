"""The figures of another structure, fitted before anything is searched beside them.

Predictions bend with orifices, volumes and pressures, so that one linear step from their usual
values leads anywhere. The fit goes by bounded steps that are taken only where the innovations
become likelier, and the motion is found again in between, because the figures change it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from kemba.identify.evidence.colour import best_fit
from kemba.identify.evidence.linear import linearise, names_of, time_blocks
from kemba.identify.evidence.refit import Frozen, refit
from kemba.identify.evidence.spike_slab import NULL
from kemba.identify.evidence.windows import error_ratio
from kemba.identify.problem.problem import Problem


class FigureFitSettings:
    """How the figures of another structure are found."""

    rounds = 4  # times that the figures are fitted along a motion
    gain = 0.02  # share of the error that another round must take away
    ahead = 100.0  # gain from which another structure is built in, every effect free in both [nats]


@dataclass(frozen=True)
class Rebuilt:
    """A problem built anew with another structure, its figures, and the `nats` by which it is ahead
    of the model as it is, with every effect free in both."""

    problem: Problem
    figures: Mapping[str, float]
    nats: float = 0.0


def settled(problem: Problem) -> tuple[Problem, dict[str, float]]:
    """The problem along the motion that its best figures make of the data, and these figures."""
    settings, free = FigureFitSettings, tuple(problem.nuisance)
    best, figures, least, found = problem, dict[str, float](), np.inf, dict[str, float]()
    for _ in range(settings.rounds):
        slopes = Frozen(free, problem.jacobian(found, free))
        found = refit(problem, NULL, found, slopes).theta
        error = error_ratio(problem, found)
        if error > least * (1.0 - settings.gain):
            break
        best, figures, least = problem, found, error
        problem = problem.relinearise(found)
    return best, figures


def ahead(problem: Problem, theta: Mapping[str, float], error: float) -> Rebuilt | None:
    """The problem with another structure, where that leaves far less unexplained.

    `theta`: the first guess; where it leaves no more than `error` times the stated noise, nothing
    is asked. Noise is as stated in both: the wrong structure's error would be learnt as colour.
    """
    plain = problem.recolour(None)
    if not problem.structures or error_ratio(plain, theta) <= error:
        return None
    built, figures = settled(plain.rebuilt(theta))
    rows = min(len(plain.residual({})), len(built.residual(figures)))
    nats = rows * (_unexplained(plain, {}) - _unexplained(built, figures))
    return Rebuilt(built, figures, nats) if nats > FigureFitSettings.ahead else None


def _unexplained(problem: Problem, theta: Mapping[str, float]) -> float:
    """Nats per row that are left when every effect within this structure may help, by a linear
    step from theta."""
    other = {problem.candidates[name].key for name in problem.structures}
    names = [name for name in names_of(problem, theta) if name not in other]
    linear, jacobian, r = linearise(problem, theta, time_blocks(problem), names)
    z = best_fit(linear)
    left, far = r + jacobian @ (z - linear.at), (z - linear.mean) / linear.width
    return 0.5 * float(left @ left + far @ far) / len(r)
