"""Is anything missing at all? What the best effect gains, and what chance would; and what logs can
tell before any effect is looked for: which would show, and which look alike.

With slopes of the residual by all effects at the model as it is, the information about two effects
is the inverse of their posterior covariance less what their prior tells; all others are free within
theirs. If A is there at its usual size s and B is fitted in its place, the expected evidence
against B is half of s^2 times the information about A that is left when B is free.
"""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_triangular
from scipy.sparse.csgraph import connected_components

from kemba.errors import enumerated
from kemba.identify.answer import DiscoverSettings
from kemba.identify.infer.linear import (
    NULL,
    Linear,
    Ranker,
    SpikeSlabSettings,
    precision_factor,
    time_blocks,
)
from kemba.identify.infer.search import Search
from kemba.identify.problem.problem import Array, Labels

# The test whether anything is missing.
# number of simulated logs: twelve of them lie beyond the p-value asked for, so that it is known
# to a third
DRAWS = 400
# share of simulated logs that reach a threshold by chance: one in fifty; stricter than
# DiscoverSettings.significant, since no left-out data are asked about formulas and detectable
# sizes
RARE = 0.02
LEAST = 1.0  # smallest threshold of the log evidence [nats]: evidence of one nat
# share of what the prior tells of an effect, below which data tell nothing of it: rounding
# alone leaves about 1e-10, as of a place along level ground
SILENT = 1e-6


@dataclass(frozen=True)
class NullTest:
    """The best score that a single effect reaches in logs in which nothing is missing.

    `scores` (draws,): its log evidence less that of nothing [nats]. `blocks`: pieces of the logs
    whose signs were redrawn.
    """

    scores: Array
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
        return float(max(np.quantile(self.scores, 1.0 - RARE), LEAST))


def bootstrap(ranker: Ranker, noise: Array, effects: Sequence[str]) -> NullTest:
    """Scores of simulated logs in which nothing is missing.

    In each of them the nominal figures are off within their tolerance, every effect is there with
    the small share of its size that the spike allows, and the noise is another. `noise` (blocks,
    k): J'e of short blocks of the error of a flexible model. A block keeps the colour of the
    noise; a random sign of each block makes new noise.
    """
    about = copy(ranker)  # the prior mean
    about.linear = replace(ranker.linear, at=ranker.linear.mean)
    nothing, *single = about.beside(NULL, effects, _slopes(ranker, noise))
    return NullTest(np.max(single - nothing, axis=0), len(noise))


def _slopes(ranker: Ranker, noise: Array) -> Array:
    """J'r (k, draws) of logs in which nothing is missing, at the prior mean."""
    linear, rng = ranker.linear, np.random.default_rng(0)
    signs = rng.choice([-1.0, 1.0], size=(DRAWS, len(noise)))
    tolerance = rng.choice(SpikeSlabSettings.tolerances, size=DRAWS)
    truth = rng.standard_normal((DRAWS, len(linear.width))) * ranker.widths((), 1.0)
    truth[:, ranker.figures] *= tolerance[:, None]
    for effect, i in ranker.lead.items():
        if not ranker.candidates[effect].lead.signed:
            truth[:, i] = np.abs(truth[:, i])
    return np.asarray((-(truth @ linear.gram.sum(axis=0)) + signs @ noise).T)


def smallest_detectable(ranker: Ranker, threshold: float) -> dict[str, float | None]:
    """Effect -> size [its switch's unit] that these data would show above the threshold [nats] nine
    times in ten; None where they show it at no size, as a place along level ground."""
    found: dict[str, float | None] = {}
    prior, covariance = SpikeSlabSettings, ranker.score(NULL).covariance
    for effect, i in ranker.lead.items():
        size = ranker.candidates[effect].lead.size
        wide, little = prior.slab * size, prior.spike * size
        told = 1.0 / covariance[i, i] - 1.0 / little**2
        if told * wide**2 < SILENT:
            found[effect] = None
            continue
        variance = 1.0 / told
        narrow = variance + little**2
        gain = 0.5 * (1.0 / narrow - 1.0 / (variance + wide**2))
        occam = 0.5 * np.log((variance + wide**2) / narrow)
        found[effect] = float(np.sqrt(max(threshold + occam, 0.5) / gain) + 1.28 * np.sqrt(narrow))
    return found


# How much of the noise a fit may have taken for effects.
# largest factor by which what is left of a block is enlarged: of what acts in one block only
# nobody can tell whether it is noise
MOST = 4.0
# of (I - H)^-1, by which what is left is enlarged; 1: errors of left-out data; 200 bench
# machines, whose noise then has 3.5 instead of 4.0 times its power
POWER = 1.0
# the same where the motion depends on the model; 0.5: power of white noise; robot logs with
# noise of 10 ms; with 1 hidden effects had p of 0.08 and 0.13, with 0.5 0.0025 to 0.012, logs
# of a clean robot 1.0 by both
POWER_IN_MOTION = 0.5


def left_out_noise(
    jacobian: Array, left: Array, width: Array, blocks: Labels, power: float = 1.0
) -> Array:
    """J'e (b, k) of each block, e being the error of a fit to the other blocks.

    `jacobian` (n, k), `left` (n,): what the fit to all blocks leaves; `width` (k,): prior widths
    of that fit; `blocks` (n,): labels of the rows; `power` of the enlargement: 1 for such errors,
    0.5 for the size of white noise. A fit of many effects takes slow noise for effects: in its own
    blocks it leaves too little of just the noise that looks like an effect.
    """
    scaled = jacobian * width
    order = np.argsort(blocks, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(blocks[order])) + 1)
    root = precision_factor(scaled.T @ scaled, np.ones(len(width)))
    pieces = [root @ _enlarged(scaled[rows], left[rows], root, power) for rows in parts]
    return np.asarray(np.stack(pieces) / width)


def _enlarged(own: Array, left: Array, root: Array, power: float) -> Array:
    """(I - H)^-power J'e (k,) of one block, by the directions of its share H in what is known."""
    seen = solve_triangular(root, own.T, lower=True)
    share, directions = np.linalg.eigh(seen @ seen.T)
    factor = np.clip(1.0 - share, 1.0 / MOST, 1.0) ** -power
    return np.asarray(directions @ (factor * (directions.T @ (seen @ left))))


def best_gain(search: Search) -> float:
    """Evidence [nats] of the best single effect over nothing, as in the simulated logs: by the
    slopes about the null's mode. A refit, with shapes of its own, finds more than any of theirs.

    Where the motion depends on the model, slopes there tell too little: of the refitted single
    effects; of the smallest sets that were refitted, where no single effect was. A larger set is
    one of many more than the simulated logs are searched for, and would look rarer than it is. So
    too where the fit of nothing ends at figures that nobody would believe.
    """
    if not (search.problem.moves or search.is_strained):
        return search.base.best_gain()
    sizes = [len(h) for h in search.points if h]
    null = search.points[NULL].log_evidence
    gains = (p.log_evidence - null for h, p in search.points.items() if len(h) == min(sizes))
    return max(gains) if sizes else 0.0


def null_test(search: Search) -> NullTest:
    """The bootstrap of the search, with the noise these data have."""
    base = search.base
    linear = base.point.mode.linear
    noise = redrawn_noise(search, linear, base.jacobian)
    return bootstrap(base.ranker(linear), noise, list(search.problem.candidates))


def redrawn_noise(search: Search, linear: Linear, jacobian: Array) -> Array:
    """J'e (b, k) of short blocks of what a fit of everything in `linear`, with slopes (n, k),
    leaves of the null's residual: noise for the bootstrap."""
    problem = search.problem
    left = search.points[NULL].mode.residual + jacobian @ (linear.best() - linear.at)
    blocks = time_blocks(problem, shortest=DiscoverSettings.fine)
    power = POWER_IN_MOTION if problem.moves else POWER
    return left_out_noise(jacobian, left, linear.width, blocks, power)


CLEAR = 5.0  # nats that tell two effects apart: Kass and Raftery 1995, 'very strong' evidence


@dataclass(frozen=True)
class Identifiability:
    """What logs can tell of the effects of a catalogue.

    `sizes`: effect -> the smallest size [unit of its switch] that shows nine times in ten, None
    where none does. `shown`: those that show at their usual size. `alike`: groups of these, each of
    which has too little evidence against another one."""

    sizes: Mapping[str, float | None]
    shown: Sequence[str]
    alike: Sequence[Sequence[str]]

    @property
    def sentence(self) -> str:
        """The whole in one sentence."""
        told = f"these logs would show {len(self.shown)} of {len(self.sizes)} effects at usual size"
        groups = "; ".join(enumerated(group) for group in self.alike)
        return f"{told}, and cannot tell apart {groups}" if groups else told


def identifiability(ranker: Ranker, sizes: Mapping[str, float | None]) -> Identifiability:
    """What the slopes of a ranker tell; `sizes`: the smallest that show, by effect."""
    usual = {e: ranker.candidates[e].lead.size for e in sizes}
    shown = [e for e, size in sizes.items() if size is not None and size <= usual[e]]
    count, labels = connected_components(expected(ranker, shown) < CLEAR, directed=False)
    groups = ([e for e, k in zip(shown, labels, strict=True) if k == own] for own in range(count))
    return Identifiability(sizes, shown, [group for group in groups if len(group) > 1])


def expected(ranker: Ranker, effects: Sequence[str]) -> Array:
    """Expected evidence (e, e) [nats] between every two of the effects, the lesser of the two
    directions; infinite on the diagonal."""
    prior, at = SpikeSlabSettings, [ranker.lead[e] for e in effects]
    size = np.array([ranker.candidates[e].lead.size for e in effects])
    shared = ranker.score(NULL).covariance[np.ix_(at, at)]
    own, itself = np.diag(shared), np.eye(len(at))
    determinant = np.outer(own, own) - shared**2 + itself
    told = own / determinant - (prior.spike * size[:, None]) ** -2.0  # of the row's effect
    left = told - (shared / determinant) ** 2 / (told.T + (prior.slab * size) ** -2.0)
    nats = np.where(itself, np.inf, 0.5 * size[:, None] ** 2 * left)
    return np.asarray(np.fmin(nats, nats.T))
