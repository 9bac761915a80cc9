"""A problem linearised at one point: sums over rows, from which all rankings are K x K algebra, and
the evidence for "these effects are large and all others are small" by it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import comb

import numpy as np
from scipy import sparse
from scipy.linalg import cho_solve, solve_triangular
from scipy.special import log_ndtr, logsumexp

from kemba.identify.infer.windows import START
from kemba.identify.problem.problem import (
    Array,
    Candidate,
    Flags,
    Labels,
    Problem,
    Theta,
)

# Where the linearised problem may lead.
FARTHEST = 4.0  # largest distance of a switch from off, in sizes, where it is tried
WIDTHS = 8.0  # largest distance of a nominal figure from its prior mean, in sigmas
BLOCKS = 4  # fewest blocks: fewer runs are cut in time: for leaving out a quarter
PIECES = 4  # pieces of a run that are told apart: quarters


@dataclass(frozen=True)
class Linear:
    """r(z) = r0 + J (z - at), as sums over b blocks of rows.

    `names` of the k parameters; `at` (k,): where it is linearised; shapes stand as logarithms.
    `mean` and `width` (k,): the prior of each parameter when it is free. `gram` (b, k, k) = J'J,
    `slope` (b, k) = J'r0, `power` (b,) = r0'r0, `count` (b,): rows per block.
    """

    names: tuple[str, ...]
    at: Array
    mean: Array
    width: Array
    gram: Array
    slope: Array
    power: Array
    count: Array

    @property
    def total(self) -> tuple[Array, Array, float]:
        """J'J (k, k), J'r0 (k,) and r0'r0 over all blocks."""
        return self.gram.sum(axis=0), self.slope.sum(axis=0), float(self.power.sum())

    def only(self, keep: Flags) -> Linear:
        """The same with the blocks where `keep` (b,) is true."""
        sums = {name: getattr(self, name)[keep] for name in ("gram", "slope", "power", "count")}
        return replace(self, **sums)

    def index(self, name: str) -> int:
        """Place of a name. Raises ValueError where it is none of `names`."""
        return self.names.index(name)

    def best(self) -> Array:
        """z (k,) of the best fit, every parameter free within its prior."""
        gram, slope, _ = self.total
        h = gram * np.outer(self.width, self.width) + np.eye(len(self.width))
        eta = (self.mean - self.at) / self.width - self.width * slope
        return np.asarray(self.at + self.width * np.linalg.solve(h, eta))

    def cost(self, z: Array) -> float:
        """Half the sum of squares at z (k,), and of how far it is from the priors."""
        (gram, slope, power), step = self.total, z - self.at
        pull = (z - self.mean) / self.width
        return 0.5 * float(power + 2.0 * slope @ step + step @ gram @ step + pull @ pull)


def precision_factor(gram: Array, width: Array) -> Array:
    """Lower Cholesky factor (k, k) of the posterior's precision in prior widths, W J'J W + 1.

    Where strong columns are nearly alike, J'J (k, k) is rounded by more than the 1 that the prior
    gives; so much is added then.
    """
    scaled = gram * np.outer(width, width) + np.eye(len(width))
    try:
        return np.asarray(np.linalg.cholesky(scaled))
    except np.linalg.LinAlgError:
        rounding = len(width) * np.finfo(float).eps * scaled.diagonal().max()
        return np.asarray(np.linalg.cholesky(scaled + rounding * np.eye(len(width))))


def names_of(problem: Problem, theta: Theta) -> tuple[str, ...]:
    """Nuisance, every switch, and the shapes of the effects that are on."""
    switches = (c.key for c in problem.candidates.values())
    return (*problem.nuisance, *switches, *usual_shapes(problem.candidates, theta))


def linearise(
    problem: Problem, theta: Theta, blocks: Labels, names: Iterable[str] | None = None
) -> tuple[Linear, Array, Array]:
    """The problem at theta, with J (n, k) and the residual (n,); `blocks` (n,) labels the rows."""
    names = names_of(problem, theta) if names is None else tuple(names)
    r, jacobian = problem.residual(theta), problem.jacobian(theta, names)
    for i, name in enumerate(names):
        if is_shape(problem, name):  # along its logarithm
            jacobian[:, i] *= theta[name]
    return condense(names, *priors(problem, theta, names), jacobian, r, blocks), jacobian, r


def condense(
    names: tuple[str, ...],
    at: Array,
    mean: Array,
    width: Array,
    jacobian: Array,
    r: Array,
    blocks: Labels,
) -> Linear:
    """Sums over each block: `jacobian` (n, k), `r` (n,), `blocks` (n,) labels of the rows; `at`,
    `mean` and `width` (k,) as in `Linear`."""
    masks = (blocks == label for label in np.unique(blocks))
    parts = ((jacobian[own], r[own]) for own in masks)  # one copy at a time
    sums = [(j.T @ j, j.T @ e, float(e @ e), len(e)) for j, e in parts]
    return Linear(tuple(names), at, mean, width, *map(np.array, zip(*sums, strict=True)))


def moved(linear: Linear, at: Array, jacobian: Array, r: Array, blocks: Labels) -> Linear:
    """The same slopes about another point, where the residual is r (n,)."""
    places = np.searchsorted(np.unique(blocks), blocks), np.arange(len(r))
    by_block = sparse.csr_array((r, places))  # quicker than parts of J, which would be copied
    return replace(linear, at=at, slope=by_block @ jacobian, power=by_block @ r)


def within(candidates: Mapping[str, Candidate], theta: Theta) -> dict[str, float]:
    """Theta with every effect's parameters inside their bounds."""
    bounds = {k: p for c in candidates.values() for k, p in c.keys().items()}
    clipped = dict(theta)
    for key in clipped.keys() & bounds.keys():
        p, value = bounds[key], clipped[key]
        if np.isnan(p.typical):  # a switch, which stays within a few sizes of off
            reach = FARTHEST * p.size
            value = np.clip(value, p.off - reach, p.off + reach)
        clipped[key] = float(np.clip(value, p.lower, p.upper))
    return usual_shapes(candidates, clipped) | clipped


def usual_shapes(candidates: Mapping[str, Candidate], theta: Theta) -> dict[str, float]:
    """The usual shapes of the effects that theta switches on."""
    return {
        key: p.typical
        for c in candidates.values()
        if c.is_on(theta)
        for key, p in c.keys().items()
        if key != c.key
    }


def is_shape(problem: Problem, name: str) -> bool:
    """Whether a name in theta is a shape parameter of an effect."""
    effect = name.rsplit(".", 1)[0]
    candidate = problem.candidates.get(effect)
    return candidate is not None and name != candidate.key


def priors(problem: Problem, theta: Theta, names: Iterable[str]) -> tuple[Array, Array, Array]:
    """Value at theta, prior mean and prior width (k,) of each name; shapes as logarithms."""
    rows = []
    for name in names:
        if name in problem.nuisance:
            nominal, sigma = problem.nuisance[name]
            rows.append((theta.get(name, nominal), nominal, sigma))
            continue
        parameter = problem.candidates[name.rsplit(".", 1)[0]].keys()[name]
        if is_shape(problem, name):
            usual = parameter.typical  # also of an effect that is absent
            rows.append((np.log(theta.get(name, usual)), np.log(usual), parameter.size))
        else:
            rows.append((theta.get(name, parameter.off), parameter.off, parameter.size))
    at, mean, width = np.array(rows).T
    return at, mean, width


def time_blocks(problem: Problem, wanted: int | None = None, shortest: float = 0.0) -> Labels:
    """A label (n,) per row: every run is a block, cut in time where there are fewer runs than
    `wanted` (None: the setting), or cut into pieces of at least `shortest` [s]."""
    wanted = BLOCKS if wanted is None else wanted
    rows = problem.rows()
    pieces = max(1, int(np.ceil(wanted / max(len(problem.runs), 1))))
    labels = np.zeros(len(rows), dtype=int)
    for i in range(len(problem.runs)):
        own = rows.run == i
        t = rows.time[own]
        span = max(float(np.ptp(t)), 1e-9)
        k = max(1, int(span / shortest)) if shortest else pieces
        labels[own] = i * 100000 + np.minimum((t - t.min()) / span * k, k - 1).astype(int)
    return np.unique(labels, return_inverse=True)[1]


def estimate(problem: Problem, linear: Linear, z: Array) -> dict[str, float]:
    """Theta of a vector z (k,); effects whose switch is off are left out.

    Nominal figures stay within their reach: a log that is wrong may ask for a negative rise time.
    """
    theta: dict[str, float] = {}
    for name, value in zip(linear.names, z, strict=True):
        theta[name] = float(np.exp(value)) if is_shape(problem, name) else float(value)
        if name in problem.nuisance:
            nominal, sigma = problem.nuisance[name]
            theta[name] = float(np.clip(value, nominal - WIDTHS * sigma, nominal + WIDTHS * sigma))
    absent = (c for c in problem.candidates.values() if not c.is_on(theta))
    off = {key for c in absent for key in tuple(c.keys())}
    return {k: v for k, v in theta.items() if k not in off}


class SpikeSlabSettings:
    """The prior: of every effect the width of its spike and of its slab, and of hypotheses."""

    # width of the spike: every effect of the catalogue may be there with this share of its size;
    # that intervals count it as 5 % and not as 2 % came of benchmarks/blind
    spike = 0.05
    slab = 0.7  # width of the slab: of a large effect, in sizes
    silent = 1e-6  # width of the spike of what is absent: none, but not singular
    # how far nominal figures are off, in prior sigmas; evidence is averaged over these: three nodes
    # around one prior sigma, which is itself uncertain
    tolerances = (0.5, 1.0, 1.5)
    nothing = 0.5  # prior probability that nothing is missing: even odds
    single = 0.4  # prior probability of one effect, shared by all
    pair = 0.01  # prior probability of two effects, shared by all pairs
    triple = 0.001  # prior probability of three, shared by all triples
    further = 0.1  # each further effect makes an answer this much less likely: as from two to three


Hypothesis = tuple[str, ...]  # names of the effects that are large, sorted
NULL: Hypothesis = ()


@dataclass(frozen=True)
class Score:
    """Log evidence of a hypothesis, and z (k,) and its covariance (k, k) under it."""

    log_evidence: float
    z: Array
    covariance: Array


class Ranker:
    """Scores hypotheses on one linearisation.

    Every effect of the catalogue may be there with a small share of its size: the `spike` width of
    its prior, in sizes (None: the setting). The effects of a hypothesis have the slab width
    instead. `silent`: effects that are absent where the hypothesis does not name them.
    """

    def __init__(
        self,
        linear: Linear,
        candidates: Mapping[str, Candidate],
        nuisance: Iterable[str],
        spike: float | None = None,
        silent: Iterable[str] = (),
    ) -> None:
        self._prior = SpikeSlabSettings
        spike = self._prior.spike if spike is None else spike
        self.linear, self.candidates, self.spike = linear, candidates, spike
        self.silent = frozenset(silent)
        free = set(nuisance)
        self.nuisance = np.array([name in free for name in linear.names])
        # how a log begins says nothing of how well figures are known
        self.figures = self.nuisance & [not name.startswith(START) for name in linear.names]
        self.lead = {c.effect: linear.index(c.key) for c in candidates.values()}
        self._gram, self._slope, self._power = linear.total

    def score(self, hypothesis: Hypothesis) -> Score:
        """Evidence, averaged over how far the nominal figures may be off."""
        parts = [self._score(hypothesis, t) for t in self._prior.tolerances]
        best = max(parts, key=lambda s: s.log_evidence)
        total = float(logsumexp([s.log_evidence for s in parts]) - np.log(len(parts)))
        return Score(total, best.z, best.covariance)

    def _score(self, hypothesis: Hypothesis, tolerance: float) -> Score:
        width = self.widths(hypothesis, tolerance)
        precision = 1.0 / width**2
        shift = self.linear.mean - self.linear.at
        eta = precision * shift - self._slope
        factor = precision_factor(self._gram, width), True
        step = width * cho_solve(factor, width * eta)
        log_det = 2.0 * float(np.sum(np.log(np.diag(factor[0]))))
        quadratic = self._power + float(precision @ shift**2) - float(eta @ step)
        covariance = np.outer(width, width) * cho_solve(factor, np.eye(len(width)))
        z = self.linear.at + step
        log_evidence = -0.5 * quadratic - 0.5 * log_det + self._sign_term(hypothesis, z, covariance)
        return Score(log_evidence, z, covariance)

    def widths(self, hypothesis: Hypothesis, tolerance: float) -> Array:
        """Prior widths (k,) under a hypothesis; nominal figures are off by `tolerance` prior
        sigmas."""
        width = self.linear.width.copy()
        width[self.figures] *= tolerance
        for effect, i in self.lead.items():
            spike = self._prior.silent if effect in self.silent else self.spike
            share = np.hypot(self._prior.slab, spike) if effect in hypothesis else spike
            width[i] *= share
        return np.asarray(np.maximum(width, 1e-12))

    def _sign_term(self, hypothesis: Hypothesis, z: Array, covariance: Array) -> float:
        """What the sign of switches that cannot be negative adds to the log evidence."""
        total = 0.0
        for effect in hypothesis:
            lead, i = self.candidates[effect].lead, self.lead[effect]
            if not lead.signed:
                sd = float(np.sqrt(covariance[i, i]))
                total += float(np.log(2.0) + log_ndtr((z[i] - lead.off) / sd))
        return total

    def table(self, given: Hypothesis = ()) -> dict[Hypothesis, float]:
        """Log evidence of `given` with each further effect; of laws of one thing, with one."""
        taken = {self.candidates[name].law_of for name in given} - {""}
        others = [name for name, c in sorted(self.candidates.items())
                  if name not in given and c.law_of not in taken]  # fmt: skip
        _, *evidence = self.beside(given, others, self._slope[:, None])[:, 0].tolist()
        return dict(zip((tuple(sorted((*given, e))) for e in others), evidence, strict=True))

    def beside(self, given: Hypothesis, others: Sequence[str], slopes: Array) -> Array:
        """Log evidence (1 + o, c) of `given`, and of it with each of the `others`, for c residuals
        whose J'r are `slopes` (k, c); averaged as in `score`."""
        parts = [self._beside(given, others, slopes, t) for t in self._prior.tolerances]
        return np.asarray(logsumexp(parts, axis=0) - np.log(len(parts)))

    def _beside(
        self, given: Hypothesis, others: Sequence[str], slopes: Array, tolerance: float
    ) -> Array:
        """The same for figures off by `tolerance` prior sigmas (Sherman and Morrison)."""
        linear = self.linear
        width, wide = (self.widths(h, tolerance) for h in (given, tuple(self.candidates)))
        shift = linear.mean - linear.at
        eta = (shift / width**2)[:, None] - slopes
        lower = precision_factor(self._gram, width)
        root = solve_triangular(lower, np.diag(width), lower=True)
        covariance = root.T @ root
        step = covariance @ eta
        i = np.array([0, *(self.lead[e] for e in others)])  # first: none of them
        ratio = wide[i] / width[i]
        ratio[0] = 1.0
        delta = ((ratio**-2.0 - 1.0) / width[i] ** 2)[:, None]  # of precision
        push, variance = delta * shift[i, None], covariance[i, i][:, None]
        share = delta / (1.0 + variance * delta)
        moved = step[i] + variance * push
        fitted = np.sum(eta * step, axis=0) + push * (2.0 * step[i] + push * variance)
        fitted -= share * moved**2
        quadratic = self._power + np.sum((shift / width) ** 2) + push * shift[i, None] - fitted
        log_det = 2.0 * np.sum(np.log(np.diag(lower))) + np.log1p(variance * delta)
        evidence = -0.5 * (quadratic + log_det) - np.log(ratio)[:, None]
        by = push - share * moved
        for effect in given:
            own = [effect] * len(i)
            evidence += self._sides(own, covariance, step, i, by, share)
        evidence[1:] += self._sides(others, covariance, step, i[1:], by[1:], share[1:])
        return np.asarray(evidence)

    def _sides(
        self, effects: Sequence[str], covariance: Array, step: Array, i: Labels, by: Array,
        share: Array,
    ) -> Array:  # fmt: skip
        """As `_sign_term` (o, c), where the prior width of parameter `i` (o,) is another one."""
        leads = [self.candidates[e].lead for e in effects]
        j = np.array([self.lead[e] for e in effects], dtype=int)
        along = covariance[j, i][:, None]
        sd = np.sqrt(np.maximum(covariance[j, j][:, None] - share * along**2, 0.0))
        z = self.linear.at[j, None] + step[j] + along * by - [[lead.off] for lead in leads]
        signed = [[lead.signed] for lead in leads]
        return np.where(signed, 0.0, np.log(2.0) + log_ndtr(z / sd))


def log_prior(hypothesis: Hypothesis, count: int) -> float:
    """Log prior probability of a hypothesis among `count` effects: all effects are equally likely,
    and each further one makes a hypothesis less likely."""
    prior, size = SpikeSlabSettings, len(hypothesis)
    share = (prior.nothing, prior.single, prior.pair, prior.triple)[min(size, 3)]
    share *= prior.further ** max(size - 3, 0)
    return float(np.log(share / max(comb(count, size), 1)))


def probabilities(evidence: Mapping[Hypothesis, float], count: int) -> dict[Hypothesis, float]:
    """Posterior probability of each hypothesis, from log evidence [nats], among `count` effects."""
    logs = np.array([e + log_prior(h, count) for h, e in evidence.items()])
    weights = np.exp(logs - logsumexp(logs))
    return dict(zip(evidence, weights.tolist(), strict=True))


def share_of(probability: Mapping[Hypothesis, float], effects: Iterable[str]) -> dict[str, float]:
    """Probability that each effect is among the missing ones."""
    return {e: sum(p for h, p in probability.items() if e in h) for e in effects}
