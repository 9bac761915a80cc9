"""The best fit of a hypothesis, by slopes of its own at every step.

A search takes most of its slopes at the fit of nothing, as a user waits. Where edges of valves move
past readings, or nominal figures are far off, these hold nearby only: hypotheses then end tens or
hundreds of nats above what they can reach, and slopes promise what is not there.
"""

from collections.abc import Callable

import numpy as np
from scipy.optimize import least_squares

from kemba.errors import KembaError
from kemba.identify.infer.linear import Hypothesis, Linear, Ranker, estimate, priors, usual_shapes
from kemba.identify.infer.null_model import Baseline, LinearisationPoint, effect_bounds
from kemba.identify.infer.refit import Fit
from kemba.identify.infer.windows import START
from kemba.identify.problem.problem import Array, Problem, Theta, bounded


class ThoroughSettings:
    """Least squares with slopes of every step."""

    # of a secant, in prior widths: wider than the steps of the cost where edges cross readings
    step = 0.1
    evaluations = 12  # of residuals with their slopes, from a start
    updates = 2  # steps by which slopes are corrected (Broyden 1965) until they are taken anew
    change = 0.1  # change of the cost at which a fit ends [nats]: far below any evidence
    off = 1e-4  # prior widths, below which an effect that cannot be negative is absent
    # prior widths inside a bound from which fits begin: beside it all steps are short
    inside = 0.01
    worst = 1e4  # sigmas, where nothing can be simulated: beyond all data


class _Slopes:
    """Slopes (n, k) along a least-squares run, corrected by what each step changes."""

    def __init__(
        self,
        errors: Callable[[Array], Array],
        slopes: Callable[[Array], Array],
        updates: int,
    ) -> None:
        self._errors, self._slopes, self._updates = errors, slopes, updates
        self._known: dict[bytes, Array] = {}
        self._jacobian = np.empty((0, 0))
        self._count, self._here = updates, (np.empty(0), np.empty(0))

    def errors(self, u: Array) -> Array:
        """The errors (n,) at u, which are kept until slopes are asked for elsewhere."""
        key = u.tobytes()
        if key not in self._known:
            self._known[key] = self._errors(u)
        return self._known[key]

    def at(self, u: Array) -> Array:
        """Slopes at u."""
        errors = self.errors(u)
        if self._count >= self._updates:
            self._jacobian, self._count = self._slopes(u), 0
        else:
            step = u - self._here[0]
            missed = errors - self._here[1] - self._jacobian @ step
            self._jacobian = self._jacobian + np.outer(missed, step) / max(
                float(step @ step), 1e-30
            )
            self._count += 1
        self._here, self._known = (u.copy(), errors), {u.tobytes(): errors}
        return self._jacobian


class ThoroughFit:
    """Fits of one hypothesis, in prior widths; `linear`: its parameters and their priors.

    Costs [nats] are half the sum of squares of readings, nominal figures and small effects, in
    sigmas of their noise and of their priors.
    """

    def __init__(self, problem: Problem, hypothesis: Hypothesis, linear: Linear) -> None:
        self.problem, self.linear = problem, linear
        self.settings = ThoroughSettings
        self.width = Ranker(linear, problem.candidates, problem.nuisance).widths(hypothesis, 1.0)
        lower, upper = effect_bounds(problem, linear.names, hypothesis)
        for name, candidate in problem.candidates.items():
            if name not in hypothesis and not candidate.lead.signed:
                lower[linear.index(candidate.key)] = candidate.lead.off
        for name in problem.nuisance:
            i = linear.index(name)
            lower[i], upper[i] = problem.limits(name)
        self.lower, self.upper = lower / self.width, upper / self.width

    def found(self, start: Theta, evaluations: int | None = None) -> Fit:
        """The best fit from one start, within so many evaluations (None: the setting)."""
        shapes = self._shapes(start)
        begin = self._inside(start)
        errors = self._errors(begin, shapes)
        slopes = _Slopes(
            lambda u: self._errors(u, shapes),
            lambda u: self._slopes(u, shapes),
            self.settings.updates,
        )
        end = least_squares(
            slopes.errors,
            begin,
            slopes.at,
            (self.lower, self.upper),
            max_nfev=evaluations or self.settings.evaluations,
            ftol=self.settings.change / max(0.5 * float(errors @ errors), 1.0),
        )
        return Fit(self._theta(end.x, shapes), float(end.cost))

    def cost(self, theta: Theta) -> float:
        """Cost of theta, moved within bounds."""
        errors = self._errors(self._inside(theta), self._shapes(theta))
        return 0.5 * float(errors @ errors)

    def _shapes(self, theta: Theta) -> dict[str, float]:
        return {k: v for k, v in theta.items() if k not in self.linear.names}

    def _inside(self, theta: Theta) -> Array:
        begin = priors(self.problem, theta, self.linear.names)[0] / self.width
        off = self.settings.inside
        return np.clip(begin, self.lower + off, self.upper - off)

    def _errors(self, u: Array, shapes: Theta) -> Array:
        """Residuals (n,), then distances (k,) from the prior means."""
        pull = u - self.linear.mean / self.width
        return np.append(self._residual(self._theta(u, shapes)), pull)

    def _slopes(self, u: Array, shapes: Theta) -> Array:
        """Secants (n + k, k) of the errors at u."""
        step, at, names = self.settings.step, self._errors(u, shapes), self.linear.names
        begun = [name for name in names if name.startswith(START)]  # each moves its own log only
        rows = len(at) - len(u)
        found = np.vstack([np.empty((rows, len(u))), np.eye(len(u))])
        columns = self.problem.jacobian(self._theta(u, shapes), begun) if begun else found
        for i, name in enumerate(names):
            if name in begun:
                found[:rows, i] = columns[:, begun.index(name)] * self.width[i]
            else:
                moved = u + step * (np.arange(len(u)) == i)
                found[:rows, i] = (self._errors(moved, shapes) - at)[:rows] / step
        return found

    def _theta(self, u: Array, shapes: Theta) -> dict[str, float]:
        """Theta at `u` (k,); `shapes`: of effects whose own are not fitted."""
        candidates = self.problem.candidates
        absent = {candidates[name].key for name in self.problem.structures}
        for candidate in candidates.values():
            i = self.linear.index(candidate.key)
            least = candidate.lead.off / self.width[i] + self.settings.off
            if not candidate.lead.signed and u[i] <= least:
                absent.add(candidate.key)
        found = estimate(self.problem, self.linear, u * self.width)
        found = {k: v for k, v in found.items() if k not in absent}
        return {**usual_shapes(candidates, found), **shapes, **found}

    def _residual(self, theta: Theta) -> Array:
        worst = self.settings.worst
        try:
            return bounded(self.problem.residual(theta), worst)
        except KembaError:
            return np.full(len(self.problem.rows()), worst)


def without(problem: Problem, theta: Theta, hypothesis: Hypothesis) -> dict[str, float]:
    """Theta without the parameters of a hypothesis."""
    own = _keys(problem, hypothesis)
    return {k: v for k, v in theta.items() if k not in own}


def with_own(
    problem: Problem, theta: Theta, hypothesis: Hypothesis, own: Theta
) -> dict[str, float]:
    """Theta with the parameters of a hypothesis as `own` has them."""
    keys = _keys(problem, hypothesis)
    return without(problem, theta, hypothesis) | {k: v for k, v in own.items() if k in keys}


def _keys(problem: Problem, hypothesis: Hypothesis) -> set[str]:
    return {key for effect in hypothesis for key in tuple(problem.candidates[effect].keys())}


def promised(base: Baseline, point: LinearisationPoint) -> float:
    """What slopes say the cost of a mode can still fall by [nats]."""
    linear = point.mode.linear
    weight = base.ranker(linear).widths(point.hypothesis, 1.0) ** -2.0
    gram, slope, power = linear.total
    off = linear.mean - linear.at
    pull = weight * off - slope
    step = np.linalg.solve(gram + np.diag(weight), pull)
    return point.mode.cost - 0.5 * float(power + weight @ off**2 - pull @ step)
