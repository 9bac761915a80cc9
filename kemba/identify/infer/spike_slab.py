"""Evidence for "these effects are large and all others are small", by linear algebra."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import comb

import numpy as np
from scipy.linalg import cho_solve, solve_triangular
from scipy.special import log_ndtr, logsumexp

from kemba.identify.infer.linear import Linear, precision_factor
from kemba.identify.infer.windows import START
from kemba.identify.problem.problem import Array, Candidate, Labels


class SpikeSlabSettings:
    """The prior: of every effect the width of its spike and of its slab, and of hypotheses."""

    # width of the spike: every effect of the catalogue may be there with this share of its size;
    # that intervals count it as 5 % and not as 2 % came of benchmarks/blind
    spike = 0.05
    slab = 0.7  # width of the slab: of a large effect, in sizes
    silent = 1e-6  # width of the spike of a formula: none, but not singular
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
        """Log evidence of `given` with each further effect."""
        others = [name for name in sorted(self.candidates) if name not in given]
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
