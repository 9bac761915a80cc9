"""How much evidence logs are expected to hold between two effects.

If A is there and B is fitted, the fit of B stays away from the prediction of A. Half the squared
distance that is left, in units of the noise, is the expected logarithm of the Bayes factor. All
that may bend to help B is free within its prior: its own parameters, the nominal figures of the
model, and how each log begins.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from kemba.identify.design.rivals import Rivals
from kemba.identify.design.settings import ExperimentSettings
from kemba.identify.evidence.linear import is_shape, priors
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
        clear = ExperimentSettings.current().clear
        return float(sum(np.log1p(n / clear) for n in self.nats.values()))


def separation(problem: Problem, rivals: Rivals) -> Separation | None:
    """The evidence between the rivals that logs of this problem's motion would hold.

    None where the logs can show fewer than two of the rivals. What was measured plays no role.
    """
    names = [name for name in rivals.names if name in problem.candidates]
    if len(names) < 2:
        return None
    at = {name: problem.residual(rivals.theta(name)) for name in names}
    figures = _columns(problem, rivals.theta(names[0]), problem.nuisance)
    free = {name: np.hstack([figures, _own(problem, rivals, name)]) for name in names}
    first, *others = names
    nats = {}
    for other in others:
        gap = at[other] - at[first]
        nats[other] = min(distance(gap, free[other]), distance(gap, free[first]))
    return Separation(first, nats)


def _own(problem: Problem, rivals: Rivals, name: str) -> Array:
    """Columns (n, k) of a rival's own parameters."""
    return _columns(problem, rivals.theta(name), problem.candidates[name].keys())


def _columns(problem: Problem, theta: Theta, names: Collection[str]) -> Array:
    """Slopes (n, k) of the residual along these parameters, per prior width."""
    names = tuple(names)
    _, _, width = priors(problem, theta, names)
    scale = [
        w * theta[name] if is_shape(problem, name) else w
        for name, w in zip(names, width, strict=True)
    ]
    return np.asarray(problem.jacobian(theta, names) * np.array(scale))


def distance(gap: Array, columns: Array) -> float:
    """Half the squared length of what `columns` (n, k), each within its prior width, cannot take
    away from `gap` (n,)."""
    h = np.eye(columns.shape[1]) + columns.T @ columns
    along = columns.T @ gap
    return 0.5 * float(gap @ gap - along @ np.linalg.solve(h, along))
