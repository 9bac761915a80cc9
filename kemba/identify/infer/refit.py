"""Nonlinear refit of one hypothesis: least squares with priors, within bounds, by Levenberg's and
Marquardt's steps. Slopes along nuisance parameters are those of the null, but for those that are
`curved`, so that only the few columns of an effect are new in a step."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.optimize import lsq_linear

from kemba.identify.infer.linear import Hypothesis, SpikeSlabSettings
from kemba.identify.problem.problem import Array, Problem, bounded


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
    """The best theta with these effects on, from `start`; what it lacks begins at its usual shape,
    a switch not at off, not too far out, and on its possible side."""
    settings, keys = RefitSettings, {problem.candidates[e].key for e in hypothesis}
    theta = {k: v for k, v in start.items() if k in problem.nuisance}
    for effect in hypothesis:
        for key, p in problem.candidates[effect].keys().items():
            if key not in keys:
                theta[key] = start.get(key, p.typical)
                continue
            least, farthest = settings.nearest * p.size, settings.farthest * p.size
            step = float(np.clip(start.get(key, p.off) - p.off, -farthest, farthest))
            if abs(step) < least or (step < 0.0 and not p.signed):
                step = -least if step < 0.0 and p.signed else least
            theta[key] = float(np.clip(p.off + step, p.lower, p.upper))
    return _LeastSquares(problem, hypothesis, theta, frozen).run()


class _LeastSquares:
    """One least-squares run in prior widths x (k,) about the priors' centres, nuisance first, then
    the parameters of the hypothesis; shapes by their logarithm."""

    def __init__(
        self, problem: Problem, hypothesis: Hypothesis, start: Mapping[str, float], frozen: Frozen
    ) -> None:
        self.problem, self.frozen = problem, frozen
        self.own = {key: p for e in hypothesis for key, p in problem.candidates[e].keys().items()}
        self.names, self.count = (*frozen.names, *self.own), len(frozen.names)
        self.curved = [n for n in problem.curved if n in frozen.names]
        slab = SpikeSlabSettings.slab
        switches = {problem.candidates[e].key for e in hypothesis}
        self.shape = np.array([n in self.own and n not in switches for n in self.names], dtype=bool)
        priors = [problem.nuisance[name] for name in frozen.names]
        priors += [(p.off, slab * p.size) if key in switches else (p.typical, p.size)
                   for key, p in self.own.items()]  # fmt: skip
        self.centre, self.width = np.array(priors).reshape(-1, 2).T
        far = np.array([RefitSettings.large if n in switches else RefitSettings.bound
                        for n in self.names])  # fmt: skip
        ends = [problem.limits(name) for name in frozen.names]
        ends += [(p.lower, p.upper) for p in self.own.values()]
        self.ends = np.array(ends).reshape(-1, 2).T
        lower, upper = (self._in(end) for end in self.ends)
        self.lower = np.maximum(-far, lower)
        self.upper = np.maximum(np.minimum(far, upper), self.lower + 1e-3)
        self.start = np.array(
            [start.get(n, m) for n, m in zip(self.names, self.centre, strict=True)]
        )

    def run(self) -> Fit:
        settings = RefitSettings
        lower, upper = self.lower + INSIDE, self.upper - INSIDE
        x = np.clip(self._in(self.start), lower, upper)
        r, damping = self._residual(x), 0.0
        at, slopes = self._slopes(x, r)
        gram, slope = self._normal_equations(x, r, at, slopes)
        for _ in range(settings.evaluations - 1):
            root = np.linalg.cholesky(gram + damping * np.diag(np.diag(gram)))
            within = lower - x, upper - x
            step = lsq_linear(root.T, -np.linalg.solve(root, slope), within).x
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
        theta = self._theta(x)
        columns = {self.names[i]: c / self.width[i] for i, c in zip(at, slopes.T, strict=True)}
        if self.problem.bends:  # slopes there along everything that no part of the hypothesis is
            names = [*self.problem.nuisance, *(c.key for c in self.problem.candidates.values())]
            anew = self.problem.jacobian(theta, names)
            columns = dict(zip(names, anew.T, strict=True)) | columns
        return Fit(theta, _cost(x, r), columns)

    def _in(self, values: Array) -> Array:
        """Values (k,) in prior widths; a shape cannot be zero or less."""
        with np.errstate(divide="ignore", invalid="ignore"):
            logs = np.log(values / self.centre)
        x = np.where(self.shape, logs, values - self.centre) / self.width
        return np.asarray(np.nan_to_num(x, nan=-np.inf, posinf=np.inf, neginf=-np.inf))

    def _theta(self, x: Array) -> dict[str, float]:
        factor = np.exp(np.where(self.shape, self.width * x, 0.0))
        values = np.where(self.shape, self.centre * factor, self.centre + self.width * x)
        own = slice(self.count, None)  # nuisance parameters may be a rounding beyond their limits
        values[own] = np.clip(values[own], *self.ends[:, own])
        return dict(zip(self.names, values.tolist(), strict=True))

    def _residual(self, x: Array) -> Array:
        return bounded(self.problem.residual(self._theta(x)), RefitSettings.absurd)

    def _slopes(self, x: Array, r: Array) -> tuple[Array, Array]:
        """Which of x (k,) have slopes of their own (curved, or effects), and these (n, c)."""
        n, settings = self.count, RefitSettings
        curved = [self.names.index(name) for name in self.curved]
        at = np.array([*curved, *range(n, len(x))], dtype=int)
        parts = []
        if curved:
            slopes = self.problem.jacobian(self._theta(x), self.curved)
            parts.append(slopes * self.width[curved])
        if self.own:
            # inwards at an upper bound: beyond it nothing changes
            steps = np.where(x[n:] + settings.step > self.upper[n:], -1.0, 1.0) * settings.step
            moved = x + np.eye(len(x))[n:] * steps[:, None]
            there = self.problem.residuals([self._theta(z) for z in moved])
            parts.append((bounded(there, settings.absurd) - r[:, None]) / steps)
        return at, np.hstack(parts) if parts else np.empty((len(r), 0))

    def _normal_equations(
        self, x: Array, r: Array, at: Array, slopes: Array
    ) -> tuple[Array, Array]:
        """Products (k, k) of all slopes, priors included, and the cost's gradient (k,)."""
        n, sigmas = self.count, self.width[: self.count]
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
