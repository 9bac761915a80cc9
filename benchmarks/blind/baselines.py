"""What simpler methods would have answered on the same logs."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg import lstsq

from kemba.identify.problem.problem import Problem

NAMES = ("one_by_bic", "all_by_least_squares")


def all_of(problem: Problem) -> dict[str, Any]:
    """Answers of every baseline: the effect named, or null for nothing."""
    problem = problem.recolour(None)  # neither whitens
    switches = {c.key: name for name, c in problem.candidates.items()}
    names = [*problem.nuisance, *switches]
    r, jacobian = problem.residual({}), problem.jacobian({}, names)
    first = len(problem.nuisance)
    return {
        "one_by_bic": one_by_bic(r, jacobian[:, first:], list(switches.values())),
        "all_by_least_squares": all_by_least_squares(problem, r, jacobian, list(switches.values())),
    }


def one_by_bic(r: Any, columns: Any, effects: list[str]) -> str | None:
    """One term at a time, the best by BIC of the white residual; nothing when none improves."""
    n = len(r)
    power = float(r @ r)
    gains = (columns.T @ r) ** 2 / np.maximum(np.sum(columns**2, axis=0), 1e-12)
    best = int(np.argmax(gains))
    before, after = n * np.log(power / n), n * np.log((power - gains[best]) / n) + np.log(n)
    return effects[best] if after < before else None


def all_by_least_squares(problem: Problem, r: Any, jacobian: Any, effects: list[str]) -> str | None:
    """Every parameter at once; the largest in sizes whose 95 % interval leaves zero out."""
    first = len(problem.nuisance)
    solution, *_ = lstsq(jacobian, -r)
    left = r + jacobian @ solution
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * float(left @ left) / max(len(r) - 40, 1)
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))[first:]
    sizes = np.array([problem.candidates[e].lead.size for e in effects])
    value = np.where(np.abs(solution[first:]) > 1.96 * sd, np.abs(solution[first:]) / sizes, 0.0)
    best = int(np.argmax(value))
    return effects[best] if value[best] > 0.1 else None
