"""How well a hypothesis can fit logs at all: least squares that trust no slope further than a step.

`discover` takes the slopes of few points, as a user waits. Here every step has slopes of its own,
and the best of several beginnings counts.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from kemba.errors import KembaError
from kemba.identify.evidence.linear import Linear, estimate, priors, usual_shapes
from kemba.identify.evidence.modes.bounded import effect_bounds
from kemba.identify.evidence.spike_slab import Hypothesis, Ranker
from kemba.identify.problem.problem import Array, Problem, Theta

STEP = 0.1  # prior widths: of a secant, wider than the steps of the cost at edges of valves
OFF = 1e-4  # prior widths: below it an effect that cannot be negative is absent
WORST = 1e4  # sigmas, where nothing can be simulated
EVALUATIONS = 12  # of residuals with their slopes, from each beginning


@dataclass(frozen=True)
class Best:
    """The best fit found: half the sum of squares [nats] of readings, nominal figures and small
    effects, in sigmas of their noise and of their priors; and where that is."""

    cost: float
    theta: dict[str, float]


def best(problem: Problem, hypothesis: Hypothesis, linear: Linear, starts: Iterable[Theta]) -> Best:
    """The best fit of a hypothesis from any of `starts`; `linear`: names and priors."""
    fit = _Fit(problem, hypothesis, linear)
    return min((fit.found(start) for start in starts), key=lambda found: found.cost)


class _Fit:
    """Least squares in prior widths; `linear` as in `best`."""

    def __init__(self, problem: Problem, hypothesis: Hypothesis, linear: Linear) -> None:
        self.problem, self.linear = problem, linear
        self.width = Ranker(linear, problem.candidates, problem.nuisance).widths(hypothesis, 1.0)
        self.lower, self.upper = effect_bounds(problem, linear.names, hypothesis)
        for name, candidate in problem.candidates.items():
            if name not in hypothesis and not candidate.lead.signed:
                self.lower[linear.index(candidate.key)] = candidate.lead.off

    def found(self, start: Theta) -> Best:
        """The best fit from one beginning."""
        bounds = self.lower / self.width, self.upper / self.width
        begin = priors(self.problem, start, self.linear.names)[0] / self.width
        shapes = {k: v for k, v in start.items() if k not in self.linear.names}

        def errors(u: Array) -> Array:
            pull = u - self.linear.mean / self.width
            return np.append(self._residual(self._theta(u, shapes)), pull)

        def slopes(u: Array) -> Array:
            at = errors(u)
            moved = [errors(u + STEP * unit) - at for unit in np.eye(len(u))]
            return np.transpose(moved) / STEP

        inside = np.clip(begin, bounds[0] + 1e-9, bounds[1] - 1e-9)
        end = least_squares(errors, inside, slopes, bounds, max_nfev=EVALUATIONS)
        return Best(float(end.cost), self._theta(end.x, shapes))

    def _theta(self, u: Array, shapes: Theta) -> dict[str, float]:
        """Theta at `u` (k,); `shapes`: of effects whose own are not fitted."""
        candidates = self.problem.candidates
        absent = {candidates[name].key for name in self.problem.structures}
        for candidate in candidates.values():
            i = self.linear.index(candidate.key)
            if not candidate.lead.signed and u[i] <= candidate.lead.off / self.width[i] + OFF:
                absent.add(candidate.key)
        theta = estimate(self.problem, self.linear, u * self.width)
        found = {k: v for k, v in theta.items() if k not in absent}
        return usual_shapes(candidates, found) | shapes | found

    def _residual(self, theta: Theta) -> Array:
        try:
            return np.clip(self.problem.residual(theta), -WORST, WORST)
        except KembaError:
            return np.full(len(self.problem.rows()), WORST)
