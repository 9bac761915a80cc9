"""The figures of another structure, fitted before anything is searched beside them.

Predictions bend with orifices, volumes and pressures, so that one linear step from their usual
values leads anywhere. The fit goes by bounded steps that are taken only where the innovations
become likelier, and the motion is found again in between, because the figures change it.
"""

from __future__ import annotations

import numpy as np

from kemba.identify.evidence.refit import Frozen, refit
from kemba.identify.evidence.spike_slab import NULL
from kemba.identify.evidence.windows import error_ratio
from kemba.identify.problem.problem import Problem
from kemba.settings import BY_HAND, Settings, setting


class FigureFitSettings(Settings):
    """How the figures of another structure are found."""

    rounds: int = setting(4, "1", "times that the figures are fitted along a motion", BY_HAND)
    gain: float = setting(
        0.02, "1", "share of the error that another round must take away", BY_HAND
    )


def settled(problem: Problem) -> tuple[Problem, dict[str, float]]:
    """The problem along the motion that its best figures make of the data, and these figures."""
    settings, free = FigureFitSettings.current(), tuple(problem.nuisance)
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
