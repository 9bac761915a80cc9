"""Which of the effects that evidence proposes are believed."""

from __future__ import annotations

import numpy as np

from kemba.identify.doubt.cross_validation import left_out
from kemba.identify.doubt.parsimony import (
    Belief,
    is_idle,
    likeliest_part,
    none_of,
    simplest,
)
from kemba.identify.evidence.search import Search
from kemba.identify.evidence.spike_slab import NULL, Hypothesis
from kemba.identify.settings import DiscoverSettings


def believed(search: Search, best: Hypothesis, p_value: float) -> Belief:
    """The best hypothesis without what is not significant, too small, refuted by left-out data or
    of no use there."""
    if not best or p_value > DiscoverSettings.significant:
        return Belief(NULL, p_value)
    belief = Belief(best, p_value)
    while belief.best:
        best = belief.best
        grave = material(search, best)
        if grave != best:
            belief = belief.without(best, grave)
            if grave:
                search.visit(grave)
            continue
        against = likeliest_part(search, best)
        gain = left_out(search, best, against)
        if gain.refuted or (len(best) > 1 and not gain.pays):
            belief = belief.without(best, against)
            continue
        simpler = simplest(search, belief)
        if simpler.best != best:
            belief = simpler
        else:
            return none_of(simpler) if is_idle(search, best) else simpler
    return belief


def material(search: Search, hypothesis: Hypothesis) -> Hypothesis:
    """Those effects of a hypothesis that are larger than a model's usual imperfection, and whose
    intervals exclude that they are absent."""
    score, linear = search.points[hypothesis].score, search.points[hypothesis].linear
    settings = DiscoverSettings

    def share(effect: str) -> float:
        c = search.problem.candidates[effect]
        i = linear.index(c.key)
        step, sd = abs(score.z[i] - c.lead.off), np.sqrt(score.covariance[i, i])
        return float(step / c.lead.size) if step > settings.apart * sd else 0.0

    return tuple(e for e in hypothesis if share(e) >= settings.matters)


def strength(search: Search, effect: str, best: Hypothesis) -> float:
    """How much evidence goes when this effect is taken out of the answer."""
    if effect not in best:
        return 0.0
    rest = tuple(h for h in best if h != effect)
    points = search.points
    return points[best].log_evidence - points[rest].log_evidence if rest in points else 0.0
