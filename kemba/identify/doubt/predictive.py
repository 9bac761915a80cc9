"""The effects of the model that is written: all that help to predict data that were not fitted.

What is sure enough to be said, and what predicts best, are two questions. A model for planning has
every effect that evidence proposes and by which left-out data are predicted better, by rows and
summed over windows; likely ones, too, and those that are too small to be reported.
"""

from __future__ import annotations

from dataclasses import replace

from kemba.identify.doubt.cross_validation import left_out, window_gain
from kemba.identify.doubt.held_out import HeldOut
from kemba.identify.doubt.parsimony import Belief, none_of
from kemba.identify.evidence.search import Search
from kemba.identify.evidence.spike_slab import Hypothesis
from kemba.identify.evidence.windows import error_ratio
from kemba.identify.problem.sensor_faults import is_fault
from kemba.identify.written.joint import joint_estimate

ANY = 1.0  # nats that are any evidence at all
STRONG = 5.0  # nats of strong evidence, by Kass and Raftery 1995
SAME = 2e-3  # share of an error by which it must change to have changed: rounding of the fit


def predictive(search: Search, best: Hypothesis, likeliest: Hypothesis) -> Hypothesis:
    """The believed effects, and those that help to predict folds of the fitted logs: of the
    likeliest hypothesis, and others for which there is strong evidence beside the believed ones."""
    told = search.points[best].log_evidence + STRONG
    larger = [h for h in search.points if set(best) < set(h) and len(h) == len(best) + 1]
    more = [e for h in larger if search.points[h].log_evidence > told for e in h if not is_fault(e)]
    whole = tuple(sorted({*best, *likeliest, *more}))
    while len(whole) > len(best) and not search.late:
        search.visit(whole)
        parts = {e: tuple(x for x in whole if x != e) for e in whole if e not in best}
        for part in parts.values():
            search.visit(part)
        gain = {e: window_gain(search, whole, part).nats for e, part in parts.items()}
        least = min(gain, key=gain.__getitem__)
        if gain[least] > ANY and left_out(search, whole, parts[least]).nats > 0.0:
            break
        whole = parts[least]
    return whole


def quoted(
    search: Search, belief: Belief, whole: Hypothesis, kept: HeldOut | None
) -> tuple[Belief, Hypothesis]:
    """Belief and written effects without those that raise the error on logs `kept` for quoting;
    one that leaves it as it was is written, but not believed. All at their joint estimates."""
    best = tuple(e for e in belief.best if e in whole)
    if kept is None or not whole:
        return (replace(belief, best=best) if best else belief), whole
    theta = _joint(search, whole)
    judge = kept.found.coarser(theta)  # one noise for all, what the whole lacks included
    there = error_ratio(judge, theta)
    for effect in reversed(whole):
        part = tuple(e for e in whole if e != effect)
        if search.late or not part:
            break
        without = error_ratio(judge, _joint(search, part))
        if without < there * (1.0 + SAME):
            best = tuple(e for e in best if e != effect)
        if without < there * (1.0 - SAME):
            whole, there = part, without
    if best == belief.best:
        return belief, whole
    return (replace(belief, best=best) if best else none_of(belief)), whole if best else ()


def _joint(search: Search, hypothesis: Hypothesis) -> dict[str, float]:
    """The joint estimate of a hypothesis, which is refitted first."""
    search.visit(hypothesis)
    return joint_estimate(search.problem, hypothesis, search.points[hypothesis].fit.theta)
