"""What is believed of a search: the fewest effects that predict left-out data as well as any more.

Evidence counts every row as new. The motion is read from the same noisy rows that judge it, so that
a row's noise is in the prediction as well; from thousands of rows a wrong effect may gain many nats
by this. Such a gain does not add up over successive rows. What physics is missing errs for longer
than a row and shows in the error that is summed over aggregation windows. So evidence proposes an
answer, and the windowed error of blocks that the fit has not seen may call for a smaller one, where

- it is within one standard error of the least error: the rule of Breiman, Friedman, Olshen and
  Stone (1984), with the standard error of the paired difference, block by block; and
- evidence claims too much: the rows of left-out blocks gain nothing by the larger answer, or more
  nats than their windows do, by more than one standard error. The first rule alone took true
  damping out of an answer on logs of the full plant: a few logs cannot tell a small gain from none.

An effect that gains little beside what the answer leaves beyond the noise is left out as well.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from kemba.identify.doubt.cross_validation import (
    gain_over_nothing,
    left_out,
    window_gain,
    window_powers,
)
from kemba.identify.evidence.bootstrap import BootstrapSettings
from kemba.identify.evidence.search import Search
from kemba.identify.evidence.spike_slab import NULL, Hypothesis, log_prior


class ParsimonySettings:
    """When left-out data choose among hypotheses that explain the data as well."""

    # of what a larger answer leaves beyond the noise, what it must explain more: a tenth; 0.18
    # gives the same answer on a real drive, 0.04 a lag more
    share = 0.1


@dataclass(frozen=True)
class Belief:
    """The hypothesis that is believed, and the p-value of nothing.

    `dismissed`: hypotheses that are too small, refuted, or no better than a smaller one. `rivals`:
    others, with as many effects, that predict left-out data as well. `remarks`: what was left out.
    `idle`: all of it was, since left-out data gain nothing by it.
    """

    best: Hypothesis = NULL
    p_value: float = 1.0
    dismissed: frozenset[Hypothesis] = frozenset()
    rivals: tuple[Hypothesis, ...] = ()
    remarks: tuple[str, ...] = ()
    idle: bool = False

    def without(self, hypothesis: Hypothesis, best: Hypothesis) -> Belief:
        """The same with `hypothesis` dismissed for `best`."""
        return replace(self, best=best, dismissed=self.dismissed | {hypothesis}, rivals=())


def simplest(search: Search, belief: Belief) -> Belief:
    """The belief with the fewest effects that left-out data need.

    Among all parts of the answer that were refitted, on the way up to it or in `_thin`. A last
    effect stays: whether there is any is asked by the bootstrap.
    """
    best = belief.best
    _thin(search, best)
    known = _known_parts(search, best)
    least = min(known, key=lambda h: window_powers(search, h).sum())
    equal = [h for h in known if is_enough(search, h, least)]
    fine = [h for h in equal if overclaimed(search, h, best) or is_little(search, h, best)]
    fine = fine or [best]
    few = [h for h in fine if len(h) == min(map(len, fine))]
    chosen = max(few, key=lambda h: search.points[h].log_evidence)
    if chosen == best:
        return belief
    # the evidence proposed this one as a part of the best only: alone it need not be the likeliest
    count, parts = len(search.problem.candidates), _known_parts(search, chosen)
    chosen = max(parts, key=lambda h: search.points[h].log_evidence + log_prior(h, count))
    return _instead(search, belief, chosen)


def _thin(search: Search, best: Hypothesis) -> None:
    """Refit the answer with ever fewer effects: each time without the one that is missed least, for
    as long as the error stays within one standard error of the smallest, and until the answer is
    due."""
    rest = least = best
    while len(rest) > 1 and not search.late:
        smaller = parts_of(rest)
        _visit(search, smaller)
        rest = min(smaller, key=lambda h: window_powers(search, h).sum())
        least = min(least, rest, key=lambda h: window_powers(search, h).sum())
        if not is_enough(search, rest, least):
            break


def _known_parts(search: Search, hypothesis: Hypothesis) -> list[Hypothesis]:
    """The hypothesis and all refitted ones with some of its effects."""
    return [h for h in search.points if h and set(h) <= set(hypothesis)]


def parts_of(hypothesis: Hypothesis) -> list[Hypothesis]:
    """All hypotheses with one effect less."""
    return [tuple(e for e in hypothesis if e != member) for member in hypothesis]


def likeliest_part(search: Search, hypothesis: Hypothesis) -> Hypothesis:
    """The likeliest hypothesis with one effect less.

    Where none was refitted, all are now: an answer of which one effect is not needed would else be
    compared with nothing, and taken for nothing.
    """
    parts = parts_of(hypothesis)
    if not any(part in search.points for part in parts):
        _visit(search, parts)
    known = (part for part in parts if part in search.points)
    return max(known, key=lambda h: search.points[h].log_evidence)


def _visit(search: Search, hypotheses: list[Hypothesis]) -> None:
    for number, hypothesis in enumerate(hypotheses, start=1):
        search.visit(hypothesis, number, len(hypotheses))


def overclaimed(search: Search, smaller: Hypothesis, larger: Hypothesis) -> bool:
    """Whether rows of left-out blocks gain nothing by the larger hypothesis, or more than their
    windows do."""
    windows = window_gain(search, larger, smaller)
    rows = left_out(search, larger, smaller)
    return rows.nats <= 0 or windows.nats + windows.error < rows.nats


def _instead(search: Search, belief: Belief, chosen: Hypothesis) -> Belief:
    """The belief in a smaller hypothesis. Others with as many effects that predict as well, within
    one standard error, are its rivals, whatever their evidence is, which was not believed of the
    larger one either; those that predict worse are dismissed, and so are larger ones that predict
    no better, or that add an effect which was left out."""
    rivals, dismissed = [], {belief.best, *belief.dismissed}
    dropped = set(belief.best).union(*belief.dismissed) - set(chosen)
    for other in search.points:
        if len(other) < len(chosen) or other == chosen:
            continue
        if len(other) == len(chosen) and as_good(search, other, chosen):
            rivals.append(other)
        elif is_enough(search, chosen, other) or (
            set(chosen) < set(other) and dropped & set(other)
        ):
            dismissed.add(other)
    remark = _remark(search, belief.best, chosen)
    return replace(
        belief,
        best=chosen,
        dismissed=frozenset(dismissed),
        rivals=tuple(sorted(rivals)),
        remarks=(*belief.remarks, remark),
    )


def is_idle(search: Search, best: Hypothesis) -> bool:
    """Whether left-out data, summed over aggregation windows, and nominal figures gain no more by
    an answer than their scatter. Its p-value counts rows, whose noise may be slower than it is
    taken to be."""
    gain = gain_over_nothing(search, best)
    return not gain.pays or gain.nats < _least()


def none_of(belief: Belief) -> Belief:
    """The belief in nothing, where the best hypothesis is idle."""
    remark = (
        f"{' and '.join(belief.best)} would fit these readings better, but left-out data are "
        "predicted as well without: it may be chance"
    )
    none = belief.without(belief.best, NULL)
    return replace(none, remarks=(*belief.remarks, remark), idle=True)


def as_good(search: Search, hypothesis: Hypothesis, best: Hypothesis) -> bool:
    """Whether a hypothesis predicts left-out data as well as the `best`: within one standard error
    of it, or with less than any evidence between them."""
    gain = window_gain(search, best, hypothesis)
    return not gain.pays or gain.nats < _least()


def is_enough(search: Search, smaller: Hypothesis, larger: Hypothesis) -> bool:
    """Whether the larger hypothesis is not needed beside the smaller one."""
    return as_good(search, smaller, larger) or is_little(search, smaller, larger)


def is_little(search: Search, smaller: Hypothesis, larger: Hypothesis) -> bool:
    """Whether the larger hypothesis gains little beside what it leaves of left-out data beyond
    their noise.

    Where a motion repeats, so does what the model lacks: effects that imitate some of it predict
    left-out data as well.
    """
    rows = search.points[larger].windowed.count.sum()
    left = 0.5 * max(0.0, float(window_powers(search, larger).sum() - rows))
    return window_gain(search, larger, smaller).nats < ParsimonySettings.share * left


def _least() -> float:
    """Nats that are any evidence at all."""
    return BootstrapSettings.least


def _remark(search: Search, best: Hypothesis, chosen: Hypothesis) -> str:
    dropped = [e for e in best if e not in chosen]
    nats = search.points[best].log_evidence - search.points[chosen].log_evidence
    return (
        f"{' and '.join(dropped)} would fit these readings better (by {nats:.0f} nats), but "
        "predict left-out data little or no better, and are left out; logs of other motions would "
        "tell"
    )
