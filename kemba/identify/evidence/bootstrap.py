"""Is nothing missing? The linear search, repeated on simulated logs in which nothing is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.special import log_ndtr, logsumexp

from kemba.identify.evidence.spike_slab import Hypothesis, Ranker, SpikeSlabSettings
from kemba.identify.problem.problem import Array
from kemba.identify.settings import DiscoverSettings


class BootstrapSettings:
    """The test whether anything is missing."""

    # number of simulated logs: twelve of them lie beyond the p-value asked for, so that it is known
    # to a third
    draws = 400
    # share of simulated logs that reach a threshold by chance: one in fifty; stricter than
    # DiscoverSettings.significant, since no left-out data are asked about formulas and detectable
    # sizes
    rare = 0.02
    least = 1.0  # smallest threshold of the log evidence [nats]: evidence of one nat
    # share of what the prior tells of an effect, below which data tell nothing of it: rounding
    # alone leaves about 1e-10, as of a place along level ground
    silent = 1e-6


@dataclass(frozen=True)
class NullTest:
    """The best score that a single effect reaches in logs in which nothing is missing.

    `scores` (draws,): its log evidence less that of nothing [nats]. `names` of the parameters.
    `blocks`: pieces of the logs whose signs were redrawn.
    """

    scores: Array
    names: tuple[str, ...]
    blocks: int

    def p_value(self, score: float) -> float:
        """Share of such logs whose best effect looks at least as good as `score`."""
        return max(self.share(score), self.finest)

    def share(self, score: float) -> float:
        """The same, as far as it was drawn."""
        return float((1 + np.sum(self.scores >= score)) / (1 + len(self.scores)))

    @property
    def finest(self) -> float:
        """The smallest p-value that so few pieces can give: so many signs make so many noises, and
        a noise and its mirror image look alike."""
        return float(2.0 ** (1 - self.blocks))

    @property
    def needed(self) -> int:
        """Pieces from which something can be significant."""
        return 1 + int(np.ceil(-np.log2(DiscoverSettings.significant)))

    @property
    def too_short(self) -> bool:
        """Whether the logs are too short for anything to be significant."""
        return self.blocks < self.needed

    @property
    def threshold(self) -> float:
        """Log evidence that such logs reach rarely."""
        settings = BootstrapSettings
        return float(max(np.quantile(self.scores, 1.0 - settings.rare), settings.least))


def bootstrap(
    ranker: Ranker,
    noise: Array,
    hypotheses: Sequence[Hypothesis],
    seed: int = 0,
    draws: int | None = None,
) -> NullTest:
    """Scores of simulated logs in which nothing is missing.

    In each of them the nominal figures are off within their tolerance, every effect is there with
    the small share of its size that the spike allows, and the noise is another. `noise` (blocks,
    k): J'e of short blocks of the error of a flexible model. A block keeps the colour of the
    noise; a random sign of each block makes new noise.
    """
    draws = BootstrapSettings.draws if draws is None else draws
    rng = np.random.default_rng(seed)
    slopes = _slopes(ranker, noise, rng, draws)
    base = _evidence(ranker, (), slopes)
    best = np.full(draws, -np.inf)
    for hypothesis in hypotheses:
        best = np.maximum(best, _evidence(ranker, hypothesis, slopes) - base)
    return NullTest(best, ranker.linear.names, len(noise))


def _slopes(ranker: Ranker, noise: Array, rng: np.random.Generator, draws: int) -> Array:
    """J'r (k, draws) of logs in which nothing is missing, at the prior mean."""
    linear = ranker.linear
    signs = rng.choice([-1.0, 1.0], size=(draws, len(noise)))
    tolerance = rng.choice(SpikeSlabSettings.tolerances, size=draws)
    truth = rng.standard_normal((draws, len(linear.width))) * ranker.widths((), 1.0)
    truth[:, ranker.figures] *= tolerance[:, None]
    for effect, i in ranker.lead.items():
        if not ranker.candidates[effect].lead.signed:
            truth[:, i] = np.abs(truth[:, i])
    return np.asarray((-(truth @ linear.gram.sum(axis=0)) + signs @ noise).T)


def _evidence(ranker: Ranker, hypothesis: Hypothesis, slopes: Array) -> Array:
    """Log evidence (draws,), up to a term that all hypotheses share."""
    gram = ranker.linear.gram.sum(axis=0)
    parts, tolerances = [], SpikeSlabSettings.tolerances
    for tolerance in tolerances:
        width = ranker.widths(hypothesis, tolerance)
        factor = cho_factor(gram * np.outer(width, width) + np.eye(len(width)), lower=True)
        eta = -width[:, None] * slopes
        step = cho_solve(factor, eta)
        value = 0.5 * np.sum(eta * step, axis=0) - float(np.sum(np.log(np.diag(factor[0]))))
        parts.append(value + _sign_terms(ranker, hypothesis, width, factor, step))
    return np.asarray(logsumexp(parts, axis=0) - np.log(len(tolerances)))


def _sign_terms(
    ranker: Ranker, hypothesis: Hypothesis, width: Array, factor: tuple[Array, bool], step: Array
) -> Array:
    """What the sign of switches that cannot be negative adds to the evidence (draws,)."""
    total = np.zeros(step.shape[1])
    for effect in hypothesis:
        if not ranker.candidates[effect].lead.signed:
            i = ranker.lead[effect]
            unit = np.zeros(len(width))
            unit[i] = 1.0
            sd = np.sqrt(cho_solve(factor, unit)[i])
            total += np.log(2.0) + log_ndtr(step[i] / sd)
    return total


def smallest_detectable(ranker: Ranker, threshold: float) -> dict[str, float | None]:
    """Effect -> size [its switch's unit] that these data would show above the threshold [nats] nine
    times in ten; None where they show it at no size, as a place along level ground."""
    found: dict[str, float | None] = {}
    prior = SpikeSlabSettings
    for effect, i in ranker.lead.items():
        size = ranker.candidates[effect].lead.size
        wide = prior.slab * size
        covariance = ranker.score((effect,)).covariance
        told = 1.0 / covariance[i, i] - 1.0 / wide**2
        if told * wide**2 < BootstrapSettings.silent:
            found[effect] = None
            continue
        variance = 1.0 / told
        narrow = variance + (prior.spike * size) ** 2
        gain = 0.5 * (1.0 / narrow - 1.0 / (variance + wide**2))
        occam = 0.5 * np.log((variance + wide**2) / narrow)
        found[effect] = float(np.sqrt(max(threshold + occam, 0.5) / gain) + 1.28 * np.sqrt(narrow))
    return found
