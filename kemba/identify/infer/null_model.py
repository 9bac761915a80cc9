"""The problem linearised at refitted hypotheses, the model as it is first: its fit, the colour of
the noise, and the linear evidence of every effect.

Slopes of effects are secants: of a delay over a row, of others over their size. A twentieth of the
size does something else, as where an edge falls between two readings. A refit, which has the
residual at its own values, would gain from this difference alone, and an effect would look missing
on a machine that has a little of many. So every hypothesis is judged by the residual at its mode:
where it fits best, when what it does not name may be there a little.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import lsq_linear

from kemba.errors import KembaError
from kemba.identify.infer.linear import (
    NULL,
    PIECES,
    Hypothesis,
    Linear,
    Ranker,
    Score,
    condense,
    estimate,
    is_shape,
    linearise,
    moved,
    names_of,
    priors,
    time_blocks,
    usual_shapes,
)
from kemba.identify.infer.refit import Fit, Frozen, refit
from kemba.identify.infer.windows import windows_of
from kemba.identify.problem.problem import Array, Labels, Problem, Theta
from kemba.identify.problem.sensor_faults import moves_readings

# How the mode of a hypothesis is found, every other effect being small.
ROUNDS = 5  # linear steps, each with the residual where it led
CHANGE = 0.1  # change of the evidence at which the last step is done [nats]
ABSURD = 1e5  # residual in sigmas at which nothing can be predicted: beyond data


@dataclass(frozen=True)
class Mode:
    """A problem linearised where a hypothesis fits best: `linear` about `theta`, with the
    `residual` (n,) there; `cost` of that point with its priors, half a sum of squares."""

    theta: dict[str, float]
    linear: Linear
    residual: Array
    cost: float


def mode_of(
    problem: Problem,
    hypothesis: Hypothesis,
    starts: Iterable[Theta],
    linear: Linear,
    jacobian: Array,
    blocks: Labels,
) -> Mode:
    """The mode of a hypothesis, by linear steps from the best of `starts`.

    `linear` and its `jacobian` (n, k): slopes that hold there; `blocks` (n,) label the rows. Where
    the motion depends on the model, the residual is as straight as its slopes: the start is kept.
    """

    def at_theta(theta: Theta, r: Array) -> Mode:
        """The problem about theta, where the residual is r (n,)."""
        z, mean, _ = priors(problem, theta, linear.names)
        pull = (z - mean) / _ranker(problem, linear).widths(hypothesis, 1.0)
        cost = 0.5 * float(r @ r + pull @ pull)
        return Mode(dict(theta), moved(linear, z, jacobian, r, blocks), r, cost)

    tried = [at_theta(theta, problem.residual(theta)) for theta in starts]
    best = at = min(tried, key=lambda mode: mode.cost)
    reached = _ranker(problem, at.linear).score(hypothesis).log_evidence
    for _ in range(0 if problem.moves else ROUNDS):
        theta = _possible(problem, hypothesis, at.linear)
        try:
            r = problem.residual(theta)
        except KembaError:
            break  # a linear estimate may point to where nothing can be simulated
        if not np.all(np.abs(r) < ABSURD):
            break
        at = at_theta(theta, r)
        best = at if at.cost < best.cost else best
        before, reached = reached, _ranker(problem, at.linear).score(hypothesis).log_evidence
        if abs(reached - before) < CHANGE:
            break
    return best


def _ranker(problem: Problem, linear: Linear, absent: Collection[str] = ()) -> Ranker:
    return Ranker(linear, problem.candidates, problem.nuisance, silent=absent)


def _possible(problem: Problem, hypothesis: Hypothesis, linear: Linear) -> dict[str, float]:
    """Theta of the best fit in which what would be on an impossible side is absent."""
    absent: set[str] = set()
    free = {n: c for n, c in problem.candidates.items() if n not in hypothesis}
    while True:
        z = _ranker(problem, linear, absent).score(hypothesis).z
        theta = estimate(problem, linear, z)
        wrong = free.keys() & problem.structures
        wrong |= {n for n, c in free.items()
                  if not c.lead.signed and theta.get(c.key, c.lead.off) <= c.lead.off}  # fmt: skip
        if wrong <= absent:
            break
        absent |= wrong
    found = {k: v for k, v in theta.items() if k not in {free[n].key for n in absent}}
    return usual_shapes(free, found) | found


# When the sensors are taken to drift.
STRONG = 3.0  # evidence from which sensors drift [nats]: Kass and Raftery 1995, twenty to one


def with_learnt_colour(
    problem: Problem, theta: Theta, blocks: Labels | None = None, careful: bool = False
) -> Problem:
    """The problem under the noise colour of a flexible model's residual (n,) about `theta`.

    A residual of the model under test would not do: a missing effect would pass for coloured
    noise. `careful`: the model at theta is good; see `Problem.recolour`.
    """
    if not problem.learns_colour:
        return problem
    found, _ = learnt_colour(problem, theta, blocks, careful)
    blamed = any(moves_readings(n) for n in theta if n not in problem.nuisance)
    return _with_drift(found, theta) if careful and (blamed or not problem.moves) else found


def _with_drift(problem: Problem, theta: Theta) -> Problem:
    """The problem with drifting sensors, where the logs are clearly likelier so."""
    drifting = problem.drifting()
    if drifting is None:
        return problem
    gain = log_likelihood(drifting, theta) - log_likelihood(problem, theta)
    return drifting if gain > STRONG else problem


def log_likelihood(problem: Problem, theta: Theta) -> float:
    """Log likelihood [nats] of the logs, up to a constant, all effects free within their priors."""
    linear, _, _ = linearise(problem, theta, time_blocks(problem))
    h = linear.total[0] * np.outer(linear.width, linear.width) + np.eye(len(linear.width))
    spread = 0.5 * float(np.linalg.slogdet(h)[1])
    return problem.log_density() - linear.cost(linear.best()) - spread


def learnt_colour(
    problem: Problem, theta: Theta, blocks: Labels | None, careful: bool
) -> tuple[Problem, Array]:
    """The same, and the Jacobian (n, k) at theta of the problem without colour."""
    plain = problem.recolour(None)
    blocks = time_blocks(plain) if blocks is None else blocks
    linear, jacobian, _ = linearise(plain, theta, blocks)
    on = tuple(n for n, c in plain.candidates.items() if c.is_on(theta))
    mode = mode_of(plain, on, [theta], linear, jacobian, blocks)
    left = mode.residual + jacobian @ (mode.linear.best() - mode.linear.at)
    return plain.recolour(left, careful=careful), jacobian


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
STEPS = 2  # linear ones, of the null fit


class Baseline:
    """The null hypothesis refitted, with slopes to every effect of the catalogue.

    `problem`: the problem under the noise colour learnt. `point`: the null. `table`: linear
    log evidence of every single effect. `jacobian` (n, k) and `residual` (n,) at the null;
    `frozen`: slopes along the nuisance parameters, for refits. `begin`: where the fit of curved
    figures begins. `windows`: aggregation windows; `blocks` (n,): time blocks of the rows, quarters
    of runs; `parts` (b,): which blocks are left out together, as a rule all those of a run.
    """

    point: LinearisationPoint
    frozen: Frozen
    jacobian: Array
    residual: Array

    def __init__(self, problem: Problem, begin: Mapping[str, float] | None = None) -> None:
        self.problem, self.begin = problem, dict(begin or {})
        self.windows = windows_of(problem)
        usual = time_blocks(problem)
        fine = time_blocks(problem, PIECES * len(problem.runs))
        windows = np.unique(fine[self.windows.first])
        short = len(windows) <= fine.max()  # a piece in which no window begins
        self.blocks: Labels = usual if short else fine
        self.parts: Labels = usual[np.unique(self.blocks, return_index=True)[1]]
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
        self.problem = with_learnt_colour(self.problem, theta, self.blocks, careful=True)
        self._rank(self.point.fit.theta)

    def _start(self) -> None:
        """Null fit, noise colour, and the linear table at the null."""
        problem, blocks = self.problem, self.blocks
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
        for _ in range(STEPS):
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
        linear, windowed = self._linear(theta, names, self.jacobian, self.residual)
        fit = Fit(dict(theta), 0.5 * float(self.residual @ self.residual))
        mode = mode_of(self.problem, NULL, [theta], linear, self.jacobian, self.blocks)
        score = self.ranker(mode.linear).score(NULL)
        self.point = LinearisationPoint(NULL, fit, linear, windowed, mode, score)

    def _linear(
        self, theta: Theta, names: Names, jacobian: Array, r: Array
    ) -> tuple[Linear, Linear]:
        """The problem about theta with these slopes (n, k), row by row and by windows."""
        at = priors(self.problem, theta, names)
        fine = condense(names, *at, jacobian, r, self.blocks)
        if len(self.windows.first) == len(r):
            return fine, fine
        sums = self.windows.sums(jacobian), self.windows.sums(r)
        return fine, condense(names, *at, *sums, self.blocks[self.windows.first])

    def judged(
        self, hypothesis: Hypothesis, fit: Fit, names: Names, slopes: Array
    ) -> LinearisationPoint:
        """The point of a refitted hypothesis with its slopes (n, k) along `names`."""
        r = self.problem.residual(fit.theta)
        linear, windowed = self._linear(fit.theta, names, slopes, r)
        starts = [fit.theta]
        if not self.problem.moves:  # and with what the mode of nothing has a little of beside it
            on, found = {key.rsplit(".", 1)[0] for key in fit.theta}, self.point.mode.theta.items()
            starts.append({k: v for k, v in found if k.rsplit(".", 1)[0] not in on} | fit.theta)
        mode = mode_of(self.problem, hypothesis, starts, linear, slopes, self.blocks)
        score = self.ranker(mode.linear).score(hypothesis)
        return LinearisationPoint(hypothesis, fit, linear, windowed, mode, score)
