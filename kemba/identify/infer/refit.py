"""Nonlinear refit of one hypothesis: least squares with priors, within bounds, by Levenberg's and
Marquardt's steps. Slopes along nuisance parameters are those of the null, but for those that are
`curved`, so that only the few columns of an effect are new in a step."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.optimize import lsq_linear

from kemba.identify.infer.linear import is_shape
from kemba.identify.infer.spike_slab import Hypothesis, SpikeSlabSettings
from kemba.identify.problem.problem import Problem, bounded
from kemba.identify.problem.types import Array, Parameter


class RefitSettings:
    """The nonlinear refit of one hypothesis."""

    evaluations = 10  # largest number of evaluations
    cost = 3e-6  # relative change of the cost, as a step promises it, at which a fit ends
    poor = 0.25  # share of what a step promises below which the next one is damped
    damping, more = 1e-2, 10.0  # share of the diagonal that is added then, and its factor
    step = 0.03  # step of finite differences, in prior widths
    bound = 8.0  # largest distance of a nominal figure or a shape from its prior mean, in widths
    # the same of an effect that is there: a zero may be off by any amount, and what is found must
    # not end at a bound
    large = 40.0
    farthest = 3.0  # largest start of a switch, in sizes
    nearest = 0.1  # smallest start of a switch, in sizes
    # a shape also starts at its default times and over this, if within two prior widths
    factor = 3.0
    absurd = 1e6  # residuals are clipped at so many sigmas: finite, beyond all data


INSIDE = 1e-9  # distance from a bound, in widths: an effect that is as good as absent stays on


@dataclass(frozen=True)
class Fit:
    """The best theta of a hypothesis.

    `cost`: half the sum of squares, priors included. `columns`: name -> slope (n,) of the residual
    along a parameter of the hypothesis, there; of shapes along their logarithm.
    """

    theta: dict[str, float]
    cost: float
    columns: dict[str, Array] = field(default_factory=dict)


@dataclass(frozen=True)
class Frozen:
    """Slopes (n, k) along the nuisance parameters, which hold at every point of a search."""

    names: tuple[str, ...]
    jacobian: Array

    @cached_property
    def gram(self) -> Array:
        """Products (k, k) of the slopes with each other."""
        return np.asarray(self.jacobian.T @ self.jacobian)


def refit(
    problem: Problem, hypothesis: Hypothesis, start: Mapping[str, float], frozen: Frozen
) -> Fit:
    """The best theta with these effects on, from `start` (and, where shapes exist, others)."""
    best: Fit | None = None
    for trial in _starts(problem, hypothesis, start):
        fit = _LeastSquares(problem, hypothesis, trial, frozen).run()
        if best is None or fit.cost < best.cost - 1e-6:
            best = fit
    assert best is not None
    return best


def _starts(
    problem: Problem, hypothesis: Hypothesis, start: Mapping[str, float]
) -> Iterable[dict[str, float]]:
    """Effects start where `start` has them, but not at off; shapes also at other values."""
    settings = RefitSettings
    theta = {k: v for k, v in start.items() if k in problem.nuisance}
    shapes: list[tuple[str, Parameter]] = []
    for effect in hypothesis:
        c = problem.candidates[effect]
        for key, parameter in c.keys().items():
            if key == c.key:
                theta[key] = _inside(start.get(key, parameter.off), parameter)
            else:
                theta[key] = start.get(key, parameter.typical)
                likely = settings.factor < np.exp(2.0 * parameter.size)
                if key not in start and likely:
                    shapes.append((key, parameter))
    yield theta
    for key, parameter in shapes:
        for factor in (1 / settings.factor, settings.factor):
            value = np.clip(parameter.typical * factor, parameter.lower, parameter.upper)
            yield {**theta, key: float(value)}


def _inside(value: float, parameter: Parameter) -> float:
    """A start that is on, not too far out, and on the possible side."""
    settings = RefitSettings
    farthest = settings.farthest * parameter.size
    step = np.clip(value - parameter.off, -farthest, farthest)
    least = settings.nearest * parameter.size
    if abs(step) < least:
        step = least if step >= 0 or not parameter.signed else -least
    if not parameter.signed:
        step = max(step, least)
    return float(np.clip(parameter.off + step, parameter.lower, parameter.upper))


class _LeastSquares:
    """One least-squares run in scaled coordinates."""

    def __init__(
        self, problem: Problem, hypothesis: Hypothesis, start: Mapping[str, float], frozen: Frozen
    ) -> None:
        self.problem, self.frozen = problem, frozen
        self.own = {key: p for e in hypothesis for key, p in problem.candidates[e].keys().items()}
        self.switches = {problem.candidates[e].key for e in hypothesis}
        self.nuisance = list(frozen.names)
        self.curved = [n for n in problem.curved if n in frozen.names]
        self.start = dict(start)
        self.sigmas = np.array([problem.nuisance[name][1] for name in frozen.names])
        self.settings, self.slab = RefitSettings, SpikeSlabSettings.slab

    def run(self) -> Fit:
        settings = self.settings
        lower, upper = self._bounds()
        lower, upper = lower + INSIDE, upper - INSIDE
        x = np.array([*self._nuisance_start(), *(self._in(k, self.start[k]) for k in self.own)])
        x = np.clip(x, lower, upper)
        r, damping = self._residual(x), 0.0
        at, slopes = self._slopes(x, r)
        gram, slope = self._normal_equations(x, r, at, slopes)
        for _ in range(settings.evaluations - 1):
            step = _best_step(gram, slope, damping, lower - x, upper - x)
            expected = -float(slope @ step + 0.5 * step @ gram @ step)
            if expected < settings.cost * _cost(x, r):
                break
            there = self._residual(x + step)
            gain = _cost(x, r) - _cost(x + step, there)
            if gain < settings.poor * expected:
                damping = max(settings.damping, settings.more * damping)
            else:
                damping /= settings.more
            if gain > 0.0:
                x, r = x + step, there
                at, slopes = self._slopes(x, r)
                gram, slope = self._normal_equations(x, r, at, slopes)
        theta, columns = self._theta(x), self._columns(at, slopes)
        if self.problem.bends:
            columns = self._anew(theta) | columns
        return Fit(theta, _cost(x, r), columns)

    def _anew(self, theta: Mapping[str, float]) -> dict[str, Array]:
        """Slopes at theta along everything that no part of the hypothesis is."""
        names = [*self.problem.nuisance, *(c.key for c in self.problem.candidates.values())]
        return dict(zip(names, self.problem.jacobian(theta, names).T, strict=True))

    def _columns(self, at: Array, slopes: Array) -> dict[str, Array]:
        """Slopes of the residual per unit of each own parameter, from those per prior width."""
        columns, own = {}, list(self.own.items())
        for i, column in zip(at.tolist(), slopes.T, strict=True):
            if i < len(self.nuisance):
                name = self.nuisance[i]
                columns[name] = column / self.problem.nuisance[name][1]
            else:
                key, p = own[i - len(self.nuisance)]
                unit = p.size if is_shape(self.problem, key) else self.slab * p.size
                columns[key] = column / unit
        return columns

    def _nuisance_start(self) -> Iterable[float]:
        for name in self.nuisance:
            nominal, sigma = self.problem.nuisance[name]
            yield (self.start.get(name, nominal) - nominal) / sigma

    def _in(self, key: str, value: float) -> float:
        """A parameter in prior widths, shapes by their logarithm."""
        p = self.own[key]
        if is_shape(self.problem, key):
            return float(np.log(value / p.typical)) / p.size
        return (value - p.off) / (self.slab * p.size)

    def _out(self, key: str, x: float) -> float:
        """The parameter of a value in prior widths, within its bounds."""
        p = self.own[key]
        if is_shape(self.problem, key):
            return float(np.clip(p.typical * np.exp(p.size * x), p.lower, p.upper))
        return float(np.clip(p.off + self.slab * p.size * x, p.lower, p.upper))

    def _bounds(self) -> tuple[Array, Array]:
        n, bound = len(self.nuisance), self.settings.bound
        far = [self.settings.large if key in self.switches else bound for key in self.own]
        upper = np.array([bound] * n + far)
        lower = -upper
        for i, name in enumerate(self.nuisance):
            nominal, sigma = self.problem.nuisance[name]
            low, high = self.problem.limits(name)
            lower[i] = max(lower[i], (low - nominal) / sigma)
            upper[i] = min(upper[i], (high - nominal) / sigma)
        for i, (key, p) in enumerate(self.own.items(), start=n):
            if np.isfinite(p.lower):
                lower[i] = max(
                    lower[i],
                    self._in(key, p.lower) if p.lower > 0 or key in self.switches else -bound,
                )
            if np.isfinite(p.upper):
                upper[i] = min(upper[i], self._in(key, p.upper))
        return lower, np.maximum(upper, lower + 1e-3)

    def _theta(self, x: Array) -> dict[str, float]:
        theta = {}
        for name, value in zip(self.nuisance, x, strict=False):
            nominal, sigma = self.problem.nuisance[name]
            theta[name] = nominal + sigma * float(value)
        for key, value in zip(self.own, x[len(self.nuisance) :], strict=True):
            theta[key] = self._out(key, float(value))
        return theta

    def _residual(self, x: Array) -> Array:
        return bounded(self.problem.residual(self._theta(x)), self.settings.absurd)

    def _slopes(self, x: Array, r: Array) -> tuple[Array, Array]:
        """Which of x (k,) have slopes of their own (curved, or effects), and these (n, c)."""
        n, settings = len(self.nuisance), self.settings
        curved = [self.nuisance.index(name) for name in self.curved]
        at = np.array([*curved, *range(n, len(x))], dtype=int)
        parts = []
        if curved:
            slopes = self.problem.jacobian(self._theta(x), self.curved)
            parts.append(slopes * self.sigmas[curved])
        if self.own:
            # inwards at an upper bound: beyond it nothing changes
            upper = self._bounds()[1][n:]
            steps = np.where(x[n:] + settings.step > upper, -settings.step, settings.step)
            moved = x + np.eye(len(x))[n:] * steps[:, None]
            there = self.problem.residuals([self._theta(z) for z in moved])
            parts.append((bounded(there, settings.absurd) - r[:, None]) / steps)
        return at, np.hstack(parts) if parts else np.empty((len(r), 0))

    def _normal_equations(
        self, x: Array, r: Array, at: Array, slopes: Array
    ) -> tuple[Array, Array]:
        """Products (k, k) of all slopes, priors included, and the cost's gradient (k,)."""
        n, sigmas = len(self.nuisance), self.sigmas
        gram, slope = np.eye(len(x)), x.copy()
        gram[:n, :n] += self.frozen.gram * np.outer(sigmas, sigmas)
        slope[:n] += (r @ self.frozen.jacobian) * sigmas
        mixed = np.zeros((len(x), len(at)))
        mixed[:n] = (slopes.T @ self.frozen.jacobian).T * sigmas[:, None]
        mixed[at] = slopes.T @ slopes
        gram[:, at] = mixed
        gram[at] = mixed.T
        gram[at, at] += 1.0
        slope[at] = x[at] + r @ slopes
        return gram, slope


def _cost(x: Array, r: Array) -> float:
    return 0.5 * float(r @ r + x @ x)


def _best_step(gram: Array, slope: Array, damping: float, low: Array, high: Array) -> Array:
    """The step (k,) between `low` and `high` by which the quadratic cost falls most."""
    root = np.linalg.cholesky(gram + damping * np.diag(np.diag(gram)))
    found = lsq_linear(root.T, -np.linalg.solve(root, slope), (low, high))
    return np.asarray(found.x)
