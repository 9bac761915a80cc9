"""How much evidence logs are expected to hold between two effects.

If A is there and B is fitted, the fit of B stays away from the prediction of A. Half the squared
distance that is left, in units of the noise, is the expected logarithm of the Bayes factor. All
that may bend to help B is free within its prior: its own parameters, the nominal figures of the
model, and how each log begins.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from kemba.errors import KembaError
from kemba.identify.design.rivals import Rivals
from kemba.identify.design.settings import ExperimentSettings, SeparationSettings
from kemba.identify.evidence.linear import LinearSettings, is_shape, priors, within
from kemba.identify.problem.problem import Array, Problem, Theta


@dataclass(frozen=True)
class Separation:
    """Expected evidence [nats] between the first rival and each other one, the lesser of the two
    directions."""

    first: str
    nats: Mapping[str, float]

    @property
    def nearest(self) -> str:
        """The rival that is hardest to tell from the first."""
        return min(self.nats, key=lambda name: self.nats[name])

    @property
    def least(self) -> float:
        """The evidence [nats] between these two."""
        return self.nats[self.nearest]

    @property
    def worth(self) -> float:
        """What a search makes large: evidence counts most where there is little of it."""
        clear = ExperimentSettings.clear
        return float(sum(np.log1p(n / clear) for n in self.nats.values()))

    def json(self, log_s: float) -> dict[str, Any]:
        """The figures for logs of `log_s` [s]."""
        return {
            "nats": self.least,
            "nats_by_rival": dict(self.nats),
            "log_s": log_s,
            "nats_per_s": self.least / log_s,
        }


def separation(problem: Problem, rivals: Rivals) -> Separation | None:
    """The evidence between the rivals that logs of this problem's motion would hold.

    None where the logs can show fewer than two of the rivals. What was measured plays no role.
    """
    names = [name for name in rivals.names if name in problem.candidates]
    if len(names) < 2:
        return None
    first, *others = names
    figures = _columns(problem, rivals.theta(first), tuple(problem.nuisance))
    sides = {name: _side(problem, rivals, name, figures) for name in names}
    nats = {
        other: min(sides[other].misses(sides[first].at), sides[first].misses(sides[other].at))
        for other in others
    }
    return Separation(first, nats)


@dataclass(frozen=True)
class _Side:
    """One rival: its theta, what it predicts there (n,), and all that may help it: names, prior
    widths (k,), and columns (n, k) per width."""

    problem: Problem
    theta: Theta
    at: Array
    names: tuple[str, ...]
    width: Array
    columns: Array

    def misses(self, truth: Array) -> float:
        """Evidence [nats] against this rival if `truth` (n,) is what happens.

        Some steps of Gauss and Newton, each confirmed by a prediction: switching instants that
        move are far from linear. No price is asked for the rival's own parameters.
        """
        gap, z = self.at - truth, np.zeros(len(self.names))
        h = np.eye(len(z)) + self.columns.T @ self.columns
        least = 0.5 * float(gap @ gap)
        figures = np.array([name in self.problem.nuisance for name in self.names])
        far = np.where(figures, LinearSettings.widths, np.inf)
        for _ in range(SeparationSettings.steps):
            z = np.clip(z - np.linalg.solve(h, self.columns.T @ gap + z), -far, far)
            try:
                gap = self.problem.residual(self._moved(z)) - truth
            except KembaError:  # so far from the nominal figures that nothing can be predicted
                break
            least = min(least, 0.5 * float(gap @ gap + z[figures] @ z[figures]))
        return least

    def _moved(self, z: Array) -> dict[str, float]:
        """Theta with its parameters moved by z (k,) widths, within their bounds."""
        moved = dict(self.theta)
        for name, step in zip(self.names, self.width * z, strict=True):
            nominal = self.problem.nuisance.get(name, (0.0, 1.0))[0]
            moved[name] = self.theta.get(name, nominal) + float(step)
        return within(self.problem.candidates, moved)


def _side(problem: Problem, rivals: Rivals, name: str, figures: Array) -> _Side:
    theta, nuisance = rivals.theta(name), tuple(problem.nuisance)
    own = tuple(problem.candidates[name].keys())
    columns = np.hstack([figures, _columns(problem, theta, own)])
    width = np.concatenate([_widths(problem, theta, nuisance), _widths(problem, theta, own)])
    return _Side(problem, theta, problem.residual(theta), (*nuisance, *own), width, columns)


def _columns(problem: Problem, theta: Theta, names: tuple[str, ...]) -> Array:
    """Slopes (n, k) of the residual along these parameters, per prior width."""
    return np.asarray(problem.jacobian(theta, names) * _widths(problem, theta, names))


def _widths(problem: Problem, theta: Theta, names: tuple[str, ...]) -> Array:
    """Prior widths (k,) of parameters, in their units; those of shapes at their values."""
    _, _, width = priors(problem, theta, names)
    return np.array(
        [
            w * theta[name] if is_shape(problem, name) else w
            for name, w in zip(names, width, strict=True)
        ]
    )
