"""Is anything missing at all? What the best effect gains, and what chance would."""

from __future__ import annotations

from kemba.identify.evidence.bootstrap import NullTest, bootstrap
from kemba.identify.evidence.colour import best_fit
from kemba.identify.evidence.left_out_noise import LeftOutNoiseSettings, left_out_noise
from kemba.identify.evidence.linear import Linear, time_blocks
from kemba.identify.evidence.search import Search
from kemba.identify.evidence.spike_slab import NULL
from kemba.identify.problem.problem import Array
from kemba.identify.settings import DiscoverSettings


def best_gain(search: Search) -> float:
    """Evidence [nats] of the best single effect over nothing, as in the simulated logs: by the
    slopes about the null's mode. A refit, with shapes of its own, finds more than any of theirs.

    Where the motion depends on the model, slopes there tell too little: of the refitted single
    effects; of the smallest sets that were refitted, where no single effect was. A larger set is
    one of many more than the simulated logs are searched for, and would look rarer than it is.
    """
    if not search.problem.moves:
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
    singles = [(name,) for name in search.problem.candidates]
    return bootstrap(base.ranker(linear), noise, singles)


def redrawn_noise(search: Search, linear: Linear, jacobian: Array) -> Array:
    """J'e (b, k) of short blocks of what a fit of everything in `linear`, with slopes (n, k),
    leaves of the null's residual: noise for the bootstrap."""
    problem, settings = search.problem, LeftOutNoiseSettings
    left = search.points[NULL].mode.residual + jacobian @ (best_fit(linear) - linear.at)
    blocks = time_blocks(problem, shortest=DiscoverSettings.fine)
    power = settings.power_in_motion if problem.moves else settings.power
    return left_out_noise(jacobian, left, linear.width, blocks, power)
