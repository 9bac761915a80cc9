"""Is nothing missing? The whole linear search, repeated on data in which nothing is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.special import logsumexp
from scipy.stats import norm

from kemba.identify.evidence.problem import Array
from kemba.identify.evidence.spike_slab import (
    SLAB_WIDTH,
    SPIKE_WIDTH,
    TOLERANCES,
    Hypothesis,
    Ranker,
)

DRAWS = 400
QUANTILE = 0.98


@dataclass(frozen=True)
class NullTest:
    """`scores` (draws,): best log evidence over nothing, in logs in which nothing is missing."""

    scores: Array
    names: tuple[str, ...]

    def p_value(self, score: float) -> float:
        """Share of such logs whose best effect looks at least as good as `score`."""
        return float((1 + np.sum(self.scores >= score)) / (1 + len(self.scores)))

    @property
    def threshold(self) -> float:
        return float(max(np.quantile(self.scores, QUANTILE), 1.0))


def bootstrap(
    ranker: Ranker,
    noise: Array,
    hypotheses: Sequence[Hypothesis],
    seed: int = 0,
    draws: int = DRAWS,
) -> NullTest:
    """Scores of simulated logs: figures off within their tolerance, effects within their spike
    width, noise redrawn.

    `noise` (blocks, k): J'e of short blocks of what a flexible model leaves; blocks keep the
    colour, their random signs make new noise.
    """
    rng = np.random.default_rng(seed)
    slopes = _slopes(ranker, noise, rng, draws)
    base = _evidence(ranker, (), slopes)
    best = np.full(draws, -np.inf)
    for hypothesis in hypotheses:
        best = np.maximum(best, _evidence(ranker, hypothesis, slopes) - base)
    return NullTest(best, ranker.linear.names)


def _slopes(ranker: Ranker, noise: Array, rng: np.random.Generator, draws: int) -> Array:
    """J'r (k, draws) of logs in which nothing is missing, at the prior mean."""
    linear = ranker.linear
    gram = linear.gram.sum(axis=0)
    signs = rng.choice([-1.0, 1.0], size=(draws, len(noise)))
    width = linear.width.copy()
    tolerance = rng.choice(TOLERANCES, size=draws)
    truth = rng.standard_normal((draws, len(width))) * width
    truth[:, ranker.nuisance] *= tolerance[:, None]
    for effect, i in ranker.lead.items():
        truth[:, i] *= SPIKE_WIDTH
        if not ranker.candidates[effect].lead.signed:
            truth[:, i] = np.abs(truth[:, i])
    return np.asarray((-(truth @ gram) + signs @ noise).T)


def _evidence(ranker: Ranker, hypothesis: Hypothesis, slopes: Array) -> Array:
    """Log evidence (draws,), up to a term that all hypotheses share."""
    gram = ranker.linear.gram.sum(axis=0)
    parts = []
    for tolerance in TOLERANCES:
        width = ranker.widths(hypothesis, tolerance)
        factor = cho_factor(gram * np.outer(width, width) + np.eye(len(width)), lower=True)
        eta = -width[:, None] * slopes
        step = cho_solve(factor, eta)
        value = 0.5 * np.sum(eta * step, axis=0) - float(np.sum(np.log(np.diag(factor[0]))))
        parts.append(value + _sides(ranker, hypothesis, width, factor, step))
    return np.asarray(logsumexp(parts, axis=0) - np.log(len(TOLERANCES)))


def _sides(
    ranker: Ranker, hypothesis: Hypothesis, width: Array, factor: tuple[Array, bool], step: Array
) -> Array:
    total = np.zeros(step.shape[1])
    for effect in hypothesis:
        if not ranker.candidates[effect].lead.signed:
            i = ranker.lead[effect]
            unit = np.zeros(len(width))
            unit[i] = 1.0
            sd = np.sqrt(cho_solve(factor, unit)[i])
            total += np.log(2.0) + norm.logcdf(step[i] / sd)
    return total


def smallest_detectable(ranker: Ranker, threshold: float) -> dict[str, float]:
    """Per effect, the size that these data would show above the threshold nine times in ten."""
    found = {}
    for effect, i in ranker.lead.items():
        size = ranker.candidates[effect].lead.size
        wide = SLAB_WIDTH * size
        covariance = ranker.score((effect,)).covariance
        variance = 1.0 / max(1.0 / covariance[i, i] - 1.0 / wide**2, 1e-12 / wide**2)
        narrow = variance + (SPIKE_WIDTH * size) ** 2
        gain = 0.5 * (1.0 / narrow - 1.0 / (variance + wide**2))
        occam = 0.5 * np.log((variance + wide**2) / narrow)
        found[effect] = float(np.sqrt(max(threshold + occam, 0.5) / gain) + 1.28 * np.sqrt(narrow))
    return found
