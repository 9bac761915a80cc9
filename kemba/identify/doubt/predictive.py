"""The effects of the model that is written: all that help to predict data that were not fitted.

What is sure enough to be said, and what predicts best, are two questions. A model for planning has
every effect that evidence proposes and by which left-out data are predicted better, by rows and
summed over windows; likely ones, too, and those that are too small to be reported.
"""

from __future__ import annotations

from dataclasses import replace

from kemba.identify.doubt.cross_validation import left_out, window_gain
from kemba.identify.doubt.held_out import HeldOut, error
from kemba.identify.doubt.parsimony import Belief, none_of
from kemba.identify.evidence.search import Search
from kemba.identify.evidence.spike_slab import Hypothesis

ANY = 1.0  # nats that are any evidence at all
SAME = 2e-3  # share of an error by which it must change to have changed: rounding of the fit


def predictive(search: Search, best: Hypothesis, likeliest: Hypothesis) -> Hypothesis:
    """The believed effects, and those of the likeliest hypothesis that help to predict folds of the
    fitted logs."""
    whole = tuple(sorted({*best, *likeliest}))
    while len(whole) > len(best) and not search.late:
        search.visit(whole)
        parts = {e: tuple(x for x in whole if x != e) for e in whole if e not in best}
        for part in parts.values():
            search.visit(part)
        search.refresh()
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
    one that leaves it as it was is written, but not believed."""
    best = belief.best
    for effect in reversed(whole) if kept is not None and len(whole) > 1 else ():
        part = tuple(e for e in whole if e != effect)
        if search.late or not part:
            break
        search.visit(part)
        search.refresh()
        without, there = (error(search, h, kept) for h in (part, whole))
        if without < there * (1.0 + SAME):
            best = tuple(e for e in best if e != effect)
        if without < there * (1.0 - SAME):
            whole = part
    if best == belief.best:
        return belief, whole
    return (replace(belief, best=best) if best else none_of(belief)), whole if best else ()
