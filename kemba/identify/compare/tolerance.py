"""How much of an error the model's figures could explain if they were off by their tolerance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from kemba.identify.evidence.problem import Array, Candidate, Problem, Theta
from kemba.settings import Settings, setting

START = "start:"  # names of nuisance parameters that say how a log begins


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
    """Slopes of a residual: along the switch of every effect (n, leads), per size, and along
    every nuisance parameter (n, nuisance), per prior sigma."""

    leads: tuple[Candidate, ...]
    by_lead: Array
    by_nuisance: Array


def slopes(problem: Problem, at: Theta) -> Slopes:
    """Of the effects of the catalogue that are no sensor's."""
    leads = tuple(c for c in problem.candidates.values() if not c.sensor)
    nuisance = list(problem.nuisance)
    jacobian = problem.jacobian(at, [*(c.key for c in leads), *nuisance])
    jacobian = jacobian * (
        [c.lead.size for c in leads] + [problem.nuisance[n][1] for n in nuisance]
    )
    return Slopes(leads, jacobian[:, : len(leads)], jacobian[:, len(leads) :])


def within_tolerance(residual: Array, known: Slopes) -> Array:
    """What is left of a residual (n,) when no nuisance parameter moves by more than `widest`."""
    widest = ToleranceSettings.current().widest
    q, triangle = np.linalg.qr(known.by_nuisance)
    step = lsq_linear(triangle, -q.T @ residual, (-widest, widest)).x
    return np.asarray(residual + known.by_nuisance @ step)


def free_starts(problem: Problem, at: Theta | None = None) -> dict[str, float]:
    """Theta `at` with each log beginning as its data say, all else nominal."""
    theta = dict(at or {})
    names = [n for n in problem.nuisance if n.startswith(START)]
    if not names:
        return theta
    sigma = np.array([problem.nuisance[n][1] for n in names])
    j, r = problem.jacobian(theta, names) * sigma, problem.residual(theta)
    step = np.linalg.solve(j.T @ j + np.eye(len(names)), -j.T @ r)
    return theta | dict(zip(names, (sigma * step).tolist(), strict=True))
