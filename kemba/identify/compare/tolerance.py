"""How much of an error the model's figures could explain if they were off by their tolerance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from kemba.identify.problem.problem import Array, Candidate, Problem, Theta
from kemba.settings import Settings, setting


class ToleranceSettings(Settings):
    """How far nominal figures may be off."""

    widest: float = setting(
        2.0,
        "1",
        "largest error of a figure, in prior sigmas",
        "convention: 95 % of them",
        decides=True,
    )


@dataclass(frozen=True)
class Slopes:
    """Slopes of a residual.

    `by_lead` (n, leads): along the switch of every effect, per size. `by_nuisance` (n, nuisance):
    along every nuisance parameter, per prior sigma.
    """

    leads: tuple[Candidate, ...]
    by_lead: Array
    by_nuisance: Array


def slopes(problem: Problem, at: Theta) -> Slopes:
    """Slopes at theta `at`, of all effects but sensor faults."""
    leads = tuple(c for c in problem.candidates.values() if not c.sensor)
    nuisance = list(problem.nuisance)
    jacobian = problem.jacobian(at, [*(c.key for c in leads), *nuisance])
    jacobian = jacobian * (
        [c.lead.size for c in leads] + [problem.nuisance[n][1] for n in nuisance]
    )
    return Slopes(leads, jacobian[:, : len(leads)], jacobian[:, len(leads) :])


def within_tolerance(residual: Array, known: Slopes) -> Array:
    """The part (n,) of a residual (n,) that is left when every nuisance parameter takes its best
    value within `widest` prior sigmas."""
    widest = ToleranceSettings.current().widest
    q, triangle = np.linalg.qr(known.by_nuisance)
    step = lsq_linear(triangle, -q.T @ residual, (-widest, widest)).x
    return np.asarray(residual + known.by_nuisance @ step)
