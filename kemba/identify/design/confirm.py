"""Evidence between rivals by true fits, where slopes alone could mislead."""

from __future__ import annotations

import numpy as np

from kemba.identify.design.rivals import Rivals
from kemba.identify.evidence.refit import Frozen, refit
from kemba.identify.problem.problem import Problem, Theta


def best_fit(problem: Problem, rivals: Rivals, name: str) -> dict[str, float]:
    """The best theta of logs if this rival is there, with the effects that all rivals share."""
    theta, names = rivals.theta(name), tuple(problem.nuisance)
    shared = (key.rsplit(".", 1)[0] for key in rivals.shared)
    frozen = Frozen(names, problem.jacobian(theta, names))
    return refit(problem, tuple(sorted({name, *shared})), theta, frozen).theta


def evidence(problem: Problem, rivals: Rivals, rival: str) -> float:
    """How much worse [nats] the best fit of a rival explains logs without noise than what made
    them, which explains them entirely."""
    return misfit(problem, best_fit(problem, rivals, rival))


def misfit(problem: Problem, theta: Theta) -> float:
    """Half the sum of squares of residuals, and of how far nominal figures are from their values,
    in sigmas."""
    r = problem.residual(theta)
    away = [(theta.get(n, m) - m) / s for n, (m, s) in problem.nuisance.items()]
    return 0.5 * float(r @ r + np.sum(np.square(away)))
