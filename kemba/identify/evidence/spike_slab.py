"""Evidence for "these effects are large and all others are small", by linear algebra."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.special import logsumexp
from scipy.stats import norm

from kemba.identify.evidence.linear import Linear
from kemba.identify.evidence.problem import Array, Candidate

SPIKE_WIDTH = 0.05  # every effect of the catalogue may be there with this share of its size
SLAB_WIDTH = 0.7  # width of a large effect, in sizes
TOLERANCES = (0.5, 1.0, 1.5)  # how far nominal figures are off, in units of their prior sigma

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
    its prior, in sizes. The effects of a hypothesis have the slab width instead.
    """

    def __init__(
        self,
        linear: Linear,
        candidates: Mapping[str, Candidate],
        nuisance: Iterable[str],
        spike: float = SPIKE_WIDTH,
    ) -> None:
        self.linear, self.candidates, self.spike = linear, candidates, spike
        self.silent: frozenset[str] = frozenset()  # effects that are absent unless supposed
        free = set(nuisance)
        self.nuisance = np.array([name in free for name in linear.names])
        self.lead = {c.effect: linear.index(c.key) for c in candidates.values()}
        self._shape = {
            effect: [
                linear.index(key) for key in tuple(c.keys()) if key != c.key and key in linear.names
            ]
            for effect, c in candidates.items()
        }
        self._gram, self._slope, self._power = linear.total

    def score(self, hypothesis: Hypothesis) -> Score:
        """Averaged over how far the nominal figures may be off."""
        parts = [self._score(hypothesis, t) for t in TOLERANCES]
        best = max(parts, key=lambda s: s.log_evidence)
        total = float(logsumexp([s.log_evidence for s in parts]) - np.log(len(parts)))
        return Score(total, best.z, best.covariance)

    def _score(self, hypothesis: Hypothesis, tolerance: float) -> Score:
        width = self.widths(hypothesis, tolerance)
        precision = 1.0 / width**2
        shift = self.linear.mean - self.linear.at
        h = self._gram + np.diag(precision)
        eta = precision * shift - self._slope
        # scaled to unit prior widths, for a well-conditioned factor
        scaled = h * np.outer(width, width)
        factor = cho_factor(scaled, lower=True)
        step = width * cho_solve(factor, width * eta)
        log_det = 2.0 * float(np.sum(np.log(np.diag(factor[0]))))
        quadratic = self._power + float(precision @ shift**2) - float(eta @ step)
        covariance = np.outer(width, width) * cho_solve(factor, np.eye(len(width)))
        z = self.linear.at + step
        log_evidence = -0.5 * quadratic - 0.5 * log_det + self._sides(hypothesis, z, covariance)
        return Score(log_evidence, z, covariance)

    def widths(self, hypothesis: Hypothesis, tolerance: float) -> Array:
        width = self.linear.width.copy()
        width[self.nuisance] *= tolerance
        for effect, i in self.lead.items():
            spike = 1e-6 if effect in self.silent else self.spike
            share = np.hypot(SLAB_WIDTH, spike) if effect in hypothesis else spike
            width[i] *= share
        return np.asarray(np.maximum(width, 1e-12))

    def _sides(self, hypothesis: Hypothesis, z: Array, covariance: Array) -> float:
        """A switch that cannot be negative halves its prior, and may rule out its posterior."""
        total = 0.0
        for effect in hypothesis:
            lead, i = self.candidates[effect].lead, self.lead[effect]
            if not lead.signed:
                sd = float(np.sqrt(covariance[i, i]))
                total += float(np.log(2.0) + norm.logcdf((z[i] - lead.off) / sd))
        return total

    def table(
        self,
        sizes: Iterable[int] = (1, 2),
        among: Iterable[str] | None = None,
        given: Hypothesis = (),
    ) -> dict[Hypothesis, float]:
        """Log evidence of every set of the wanted sizes that contains `given`."""
        names = sorted(self.candidates if among is None else among)
        others = [n for n in names if n not in given]
        found = {}
        for size in sizes:
            for extra in combinations(others, size - len(given)):
                key = tuple(sorted((*given, *extra)))
                found[key] = self.score(key).log_evidence
        return found


def log_prior(hypothesis: Hypothesis, count: int) -> float:
    """Nothing is missing half of the time; each further effect is rarer, and all are alike."""
    share = {0: 0.5, 1: 0.4, 2: 0.01, 3: 0.001}[min(len(hypothesis), 3)]
    ways = {0: 1.0, 1: count, 2: count * (count - 1) / 2}.get(
        len(hypothesis), count * (count - 1) * (count - 2) / 6
    )
    return float(np.log(share / max(ways, 1.0)))


def probabilities(evidence: Mapping[Hypothesis, float], count: int) -> dict[Hypothesis, float]:
    """Posterior over the hypotheses listed."""
    logs = np.array([e + log_prior(h, count) for h, e in evidence.items()])
    weights = np.exp(logs - logsumexp(logs))
    return dict(zip(evidence, weights.tolist(), strict=True))
