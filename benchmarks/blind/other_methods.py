"""What other methods answer on the same logs, with kemba's catalogue as their terms.

What the nominal model leaves unexplained is linear in small effects. Every method gets that
disturbance and one column per effect (its sensitivity, for an effect of usual size), with nominal
figures that may be a little off already accounted for. The noise is white to them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import lstsq

from kemba.identify.problem.problem import Problem

MOST = 10  # terms that BIC may add
THRESHOLDS = (0.03, 0.1, 0.3, 1.0)  # of STLSQ, in usual sizes of effects; BIC chooses
SURE = 1.96  # sigma of a 95 % interval


@dataclass(frozen=True)
class Terms:
    """The disturbance (n,) and what effects of usual size add to it (n, m); both in noise."""

    disturbance: Any
    columns: Any
    effects: Sequence[str]

    @classmethod
    def of(cls, problem: Problem) -> Terms:
        """The terms of a problem, without what its nominal figures within their priors explain."""
        plain = problem.recolour(None)
        candidates = plain.candidates
        names = [*plain.nuisance, *(c.key for c in candidates.values())]
        jacobian = plain.jacobian({}, names)
        count = len(plain.nuisance)
        sizes = np.array([c.lead.size for c in candidates.values()])
        both = np.column_stack([-plain.residual({}), jacobian[:, count:] * sizes])
        _, left = _by_figures(plain, jacobian[:, :count], both)
        return cls(left[:, 0], left[:, 1:], list(candidates))

    def bic(self, chosen: Sequence[int]) -> tuple[float, Any]:
        """Bayesian information criterion of some terms, and their coefficients."""
        columns, n = self.columns[:, chosen], len(self.disturbance)
        found = lstsq(columns, self.disturbance)[0] if len(chosen) else np.zeros(0)
        left = self.disturbance - columns @ found
        return float(n * np.log(left @ left / n) + len(chosen) * np.log(n)), found

    def told(self, chosen: Sequence[int], coefficients: Any) -> list[str]:
        """Names of terms, what explains most first."""
        power = np.abs(coefficients) * np.linalg.norm(self.columns[:, chosen], axis=0)
        return [self.effects[chosen[i]] for i in np.argsort(-power)]


def _by_figures(problem: Problem, jacobian: Any, columns: Any) -> tuple[Any, Any]:
    """How nominal figures within their priors explain columns (n, k), and what they leave."""
    sigmas = np.array([sigma for _, sigma in problem.nuisance.values()])
    figures = np.vstack([jacobian, np.diag(1.0 / sigmas)])
    padded = np.vstack([columns, np.zeros((len(sigmas), columns.shape[1]))])
    found = lstsq(figures, padded)[0]
    return found, padded - figures @ found


def figures_of(problem: Problem) -> dict[str, float]:
    """Nominal figures as they fit a problem best while nothing is missing, in two linear steps."""
    plain, theta = problem.recolour(None), {name: v for name, (v, _) in problem.nuisance.items()}
    for _ in range(2):
        jacobian = plain.jacobian(theta, list(theta))
        steps, _ = _by_figures(plain, jacobian, -plain.residual(theta)[:, None])
        theta = {
            name: theta[name] + float(step) for name, step in zip(theta, steps[:, 0], strict=True)
        }
    return theta


def by_bic(terms: Terms) -> list[str]:
    """Terms added one by one, each time the one that lowers BIC most (SciPy's least squares)."""
    chosen: list[int] = []
    best, found = terms.bic(chosen)
    while len(chosen) < MOST:
        rest = [i for i in range(len(terms.effects)) if i not in chosen]
        tried = [(terms.bic([*chosen, i]), i) for i in rest]
        (value, coefficients), i = min(tried, key=lambda one: one[0][0])
        if value >= best:
            break
        chosen, best, found = [*chosen, i], value, coefficients
    return terms.told(chosen, found)


def all_at_once(terms: Terms) -> list[str]:
    """Every term at once; those whose 95 % interval leaves zero out."""
    everything = list(range(len(terms.effects)))
    _, found = terms.bic(everything)
    left = terms.disturbance - terms.columns @ found
    variance = left @ left / max(len(left) - len(found), 1)
    inverse = np.linalg.pinv(terms.columns.T @ terms.columns)
    sd = np.sqrt(np.maximum(variance * np.diag(inverse), 0.0))
    kept = np.flatnonzero(np.abs(found) > SURE * sd)
    return terms.told(kept.tolist(), found[kept])


def by_sindy(terms: Terms) -> list[str]:
    """PySINDy's thresholded least squares (STLSQ), its threshold chosen by BIC."""
    from pysindy import STLSQ

    tried = []
    for threshold in THRESHOLDS:
        method = STLSQ(threshold=threshold)
        method.fit(terms.columns, terms.disturbance[:, None])
        chosen = np.flatnonzero(method.coef_[0]).tolist()
        tried.append((*terms.bic(chosen), chosen))
    _, found, chosen = min(tried, key=lambda one: one[0])
    return terms.told(chosen, found)


METHODS: dict[str, Callable[[Terms], list[str]]] = {
    "SciPy, terms added by BIC": by_bic,
    "SciPy, all terms at once": all_at_once,
    "PySINDy": by_sindy,
}


def all_of(problem: Problem) -> dict[str, list[str]]:
    """Effects that each method names, the most important first; PySINDy where it is installed."""
    terms = Terms.of(problem)
    found = {}
    for name, method in METHODS.items():
        try:
            found[name] = method(terms)
        except ModuleNotFoundError:  # none of kemba's dependencies
            continue
    return found
