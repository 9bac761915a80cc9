"""The problem linearised at refitted hypotheses, the model as it is first: its fit, the colour of
the noise, and the linear evidence of every effect."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import lsq_linear

from kemba.identify.infer.colour import learnt_colour, with_learnt_colour
from kemba.identify.infer.linear import (
    Linear,
    LinearSettings,
    condense,
    estimate,
    is_shape,
    names_of,
    priors,
    time_blocks,
)
from kemba.identify.infer.mode import Mode, mode_of
from kemba.identify.infer.refit import Fit, Frozen, refit
from kemba.identify.infer.spike_slab import NULL, Hypothesis, Ranker, Score
from kemba.identify.infer.windows import Windows, windows_of
from kemba.identify.problem.problem import Problem
from kemba.identify.problem.types import Array, Labels


@dataclass(frozen=True)
class LinearisationPoint:
    """A hypothesis refitted, with the problem linearised there.

    `linear`: by rows; `windowed`: by sums over aggregation windows; in both of them effects that it
    does not name are absent. `mode`: its best fit, where they may be there a little.
    `score`: evidence of the hypothesis. `left_out`: errors that are computed already.
    """

    hypothesis: Hypothesis
    fit: Fit
    linear: Linear
    windowed: Linear
    mode: Mode
    score: Score
    left_out: dict[bool, Array] = field(default_factory=dict, compare=False)

    @property
    def log_evidence(self) -> float:
        """Log evidence [nats] of the hypothesis."""
        return self.score.log_evidence

    @property
    def fitted_error(self) -> float:
        """Error in units of the noise on the fitted logs: RMS over aggregation windows."""
        return float(np.sqrt(self.windowed.power.sum() / self.windowed.count.sum()))


class Division:
    """The rows of a problem divided into time blocks (n,), quarters of runs, and into aggregation
    windows; `parts` (b,): which blocks are left out together, as a rule all those of a run."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.windows: Windows = windows_of(problem)
        usual = time_blocks(problem)
        fine = time_blocks(problem, LinearSettings.pieces * len(problem.runs))
        windows = np.unique(fine[self.windows.first])
        short = len(windows) <= fine.max()  # a piece in which no window begins
        self.blocks: Labels = usual if short else fine
        self.parts: Labels = usual[np.unique(self.blocks, return_index=True)[1]]

    def linear(
        self, theta: Mapping[str, float], names: tuple[str, ...], jacobian: Array, r: Array
    ) -> tuple[Linear, Linear]:
        """The problem about theta with these slopes (n, k), row by row and by windows."""
        at = priors(self.problem, theta, names)
        fine = condense(names, *at, jacobian, r, self.blocks)
        if len(self.windows.first) == len(r):
            return fine, fine
        sums = self.windows.sums(jacobian), self.windows.sums(r)
        windowed = condense(names, *at, *sums, self.blocks[self.windows.first])
        return fine, windowed


def within_bounds(problem: Problem, point: LinearisationPoint) -> Array:
    """z (k,) of a refitted hypothesis where its density is largest within the bounds of its
    effects and of the nuisance parameters; shapes as logarithms, as in `Linear`."""
    z, covariance = point.score.z, point.score.covariance
    names = point.linear.names
    lower, upper = effect_bounds(problem, names, point.hypothesis)
    for name in problem.nuisance:
        i = names.index(name)
        lower[i], upper[i] = problem.limits(name)
    if np.all((lower <= z) & (z <= upper)):
        return z
    sd = np.sqrt(np.diag(covariance))
    root = np.linalg.cholesky(covariance / np.outer(sd, sd))
    lower, upper = (lower - z) / sd, (upper - z) / sd
    white = np.linalg.inv(root)  # of unit covariance: least squares
    found = lsq_linear(white, np.zeros(len(z)), (lower, np.maximum(upper, lower + 1e-9)))
    return np.asarray(z + sd * found.x)


def effect_bounds(
    problem: Problem, names: tuple[str, ...], hypothesis: Hypothesis
) -> tuple[Array, Array]:
    """Smallest and largest z (k,) of `names`, by the effects of a hypothesis; infinite for all that
    is no part of it."""
    lower, upper = np.full(len(names), -np.inf), np.full(len(names), np.inf)
    own = {k: p for effect in hypothesis for k, p in problem.candidates[effect].keys().items()}
    for i, name in enumerate(names):
        if name in own:
            ends = np.array([own[name].lower, own[name].upper])
            if is_shape(problem, name):
                with np.errstate(divide="ignore"):
                    ends = np.log(np.maximum(ends, 0.0))
            lower[i], upper[i] = ends
    return lower, upper


Names = tuple[str, ...]
ROUNDS = 2  # linear steps


class Baseline:
    """The null hypothesis refitted, with slopes to every effect of the catalogue.

    `problem`: the problem under the noise colour learnt. `point`: the null. `table`: linear
    log evidence of every single effect. `jacobian` (n, k) and `residual` (n,) at the null;
    `frozen`: slopes along the nuisance parameters, for refits. `begin`: where the fit of curved
    figures begins.
    """

    point: LinearisationPoint
    frozen: Frozen
    jacobian: Array
    residual: Array

    def __init__(self, problem: Problem, begin: Mapping[str, float] | None = None) -> None:
        self.problem, self.begin = problem, dict(begin or {})
        self.division = Division(problem)
        self.table: dict[Hypothesis, float] = {}
        self._start()

    def ranker(self, linear: Linear, spike: float | None = None) -> Ranker:
        """Scores hypotheses on `linear`; `spike`: width of absent effects in sizes (None: the
        setting)."""
        return Ranker(linear, self.problem.candidates, self.problem.nuisance, spike)

    def best_gain(self) -> float:
        """Linear evidence [nats] of the best single effect over the null, about the null's mode."""
        return max(self.table.values()) - self.point.log_evidence

    def seen_from(self, theta: Mapping[str, float]) -> None:
        """Learn the noise colour from the residual at theta, and rank all hypotheses again."""
        blocks = self.division.blocks
        self.problem = with_learnt_colour(self.problem, theta, blocks, careful=True)
        self._rank(self.point.fit.theta)

    def _start(self) -> None:
        """Null fit, noise colour, and the linear table at the null."""
        problem, blocks = self.problem, self.division.blocks
        free = tuple(problem.nuisance)
        if problem.own_figures:  # a linear estimate of these runs off
            frozen = Frozen(free, problem.jacobian(self.begin, free))
            self._rank(refit(problem, NULL, self.begin, frozen).theta)
            return
        moving = problem.moves  # then slopes hold within the nuisance parameters' tolerances
        names = names_of(problem, {}) if moving else free
        known = problem.jacobian({}, names)
        slopes = known[:, [names.index(n) for n in free]]
        theta: dict[str, float] = {}
        for _ in range(ROUNDS):
            r = problem.residual(theta)
            linear = condense(free, *priors(problem, theta, free), slopes, r, blocks)
            theta = estimate(problem, linear, linear.best())
        # where the motion moves, the search learns the colour with it
        if not moving and problem.learns_colour:
            self.problem, plain = learnt_colour(problem, theta, blocks, careful=False)
            self._rank(theta, self.problem.whiten(plain))
        else:
            self._rank(theta, known if moving else None)

    def _rank(self, theta: Mapping[str, float], jacobian: Array | None = None) -> None:
        """Linearise at theta, and score every hypothesis there."""
        names = names_of(self.problem, theta)
        self.jacobian = self.problem.jacobian(theta, names) if jacobian is None else jacobian
        self.residual = self.problem.residual(theta)
        figures = tuple(self.problem.nuisance)  # the first of the names
        self.frozen = Frozen(figures, self.jacobian[:, : len(figures)].copy())
        self.score(theta, names)
        self.table = self.ranker(self.point.mode.linear).table()

    def score(self, theta: Mapping[str, float] | None = None, names: Names = ()) -> None:
        """Score the null with the slopes as they are, at theta or where it was."""
        theta = self.point.fit.theta if theta is None else theta
        names = names or self.point.linear.names
        linear, windowed = self.division.linear(theta, names, self.jacobian, self.residual)
        fit = Fit(dict(theta), 0.5 * float(self.residual @ self.residual))
        mode = mode_of(self.problem, NULL, [theta], linear, self.jacobian, self.division.blocks)
        score = self.ranker(mode.linear).score(NULL)
        self.point = LinearisationPoint(NULL, fit, linear, windowed, mode, score)

    def judged(
        self, hypothesis: Hypothesis, fit: Fit, names: Names, slopes: Array
    ) -> LinearisationPoint:
        """The point of a refitted hypothesis with its slopes (n, k) along `names`."""
        r = self.problem.residual(fit.theta)
        linear, windowed = self.division.linear(fit.theta, names, slopes, r)
        starts = [fit.theta]
        if not self.problem.moves:  # and with what the mode of nothing has a little of beside it
            on, found = {key.rsplit(".", 1)[0] for key in fit.theta}, self.point.mode.theta.items()
            starts.append({k: v for k, v in found if k.rsplit(".", 1)[0] not in on} | fit.theta)
        blocks = self.division.blocks
        mode = mode_of(self.problem, hypothesis, starts, linear, slopes, blocks)
        score = self.ranker(mode.linear).score(hypothesis)
        return LinearisationPoint(hypothesis, fit, linear, windowed, mode, score)
