"""Model selection: the fewest effects that predict left-out data as well as any more.

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
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from kemba.identify.answer import DiscoverSettings
from kemba.identify.infer.cross_validation import (
    HeldOut,
    gain_over_nothing,
    left_out,
    left_out_error,
    window_gain,
    window_powers,
)
from kemba.identify.infer.joint import JointFit, joint_estimate
from kemba.identify.infer.linear import NULL, Hypothesis, log_prior
from kemba.identify.infer.search import Search
from kemba.identify.infer.significance import LEAST
from kemba.identify.infer.windows import error_ratio
from kemba.identify.problem.problem import Problem
from kemba.identify.problem.sensor_faults import is_fault


@dataclass(frozen=True)
class Selection:
    """The hypothesis that is selected, and the p-value of nothing.

    `dismissed`: hypotheses that are too small, refuted, or no better than a smaller one. `rivals`:
    others, with as many effects, that predict left-out data as well. `remarks`: what was left out.
    `unsupported`: all of it was, since left-out data gain nothing by it.
    """

    best: Hypothesis = NULL
    p_value: float = 1.0
    dismissed: frozenset[Hypothesis] = frozenset()
    rivals: tuple[Hypothesis, ...] = ()
    remarks: tuple[str, ...] = ()
    unsupported: bool = False

    def without(self, hypothesis: Hypothesis, best: Hypothesis) -> Selection:
        """The same with `hypothesis` dismissed for `best`."""
        return replace(self, best=best, dismissed=self.dismissed | {hypothesis}, rivals=())


def simplest(search: Search, selection: Selection) -> Selection:
    """The selection with the fewest effects that left-out data need.

    Among all parts of the answer that were refitted, on the way up to it or in `_thin`. A last
    effect stays: whether there is any is asked by the bootstrap.
    """
    best = selection.best
    _thin(search, best)
    known = [h for h in search.points if h and set(h) <= set(best)]  # it and its parts
    least = min(known, key=lambda h: window_powers(search, h).sum())
    equal = [h for h in known if as_good(search, h, least)]
    fine = [h for h in equal if overclaimed(search, h, best)] or [best]
    few = [h for h in fine if len(h) == min(map(len, fine))]
    chosen = max(few, key=lambda h: search.points[h].log_evidence)
    if chosen == best:
        return selection
    # the evidence proposed this one as a part of the best only: alone it need not be the likeliest
    count, parts = len(search.problem.candidates), [h for h in known if set(h) <= set(chosen)]
    chosen = max(parts, key=lambda h: search.points[h].log_evidence + log_prior(h, count))
    return _instead(search, selection, chosen)


def _thin(search: Search, best: Hypothesis) -> None:
    """Refit with ever fewer effects while the error stays within one standard error."""
    rest = least = best
    while len(rest) > 1 and not search.late:
        smaller = _parts_of(rest)
        _visit(search, smaller)
        rest = min(smaller, key=lambda h: window_powers(search, h).sum())
        least = min(least, rest, key=lambda h: window_powers(search, h).sum())
        if not as_good(search, rest, least):
            break


def _parts_of(hypothesis: Hypothesis) -> list[Hypothesis]:
    """All hypotheses with one effect less."""
    return [tuple(e for e in hypothesis if e != member) for member in hypothesis]


def likeliest_part(search: Search, hypothesis: Hypothesis) -> Hypothesis:
    """The likeliest hypothesis with one effect less.

    Where none was refitted, all are now: an answer of which one effect is not needed would else be
    compared with nothing, and taken for nothing.
    """
    parts = _parts_of(hypothesis)
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


def _instead(search: Search, selection: Selection, chosen: Hypothesis) -> Selection:
    """A smaller hypothesis selected, as good ones its rivals, worse or larger ones dismissed."""
    rivals, dismissed = [], {selection.best, *selection.dismissed}
    dropped = set(selection.best).union(*selection.dismissed) - set(chosen)
    for other in search.points:
        if len(other) < len(chosen) or other == chosen:
            continue
        if len(other) == len(chosen) and as_good(search, other, chosen):
            rivals.append(other)
        elif as_good(search, chosen, other) or (set(chosen) < set(other) and dropped & set(other)):
            dismissed.add(other)
    gone = [e for e in selection.best if e not in chosen]
    nats = search.points[selection.best].log_evidence - search.points[chosen].log_evidence
    remark = (
        f"{' and '.join(gone)} would fit these readings better (by {nats:.0f} nats), but "
        "predict left-out data little or no better, and are left out; logs of other motions would "
        "tell"
    )
    remarks, smaller = (*selection.remarks, remark), frozenset(dismissed)
    return Selection(chosen, selection.p_value, smaller, tuple(sorted(rivals)), remarks)


def is_unsupported(search: Search, best: Hypothesis) -> bool:
    """Whether left-out data, summed over aggregation windows, and nominal figures gain no more by
    an answer than their scatter. Its p-value counts rows, whose noise may be slower than it is
    taken to be."""
    gain = gain_over_nothing(search, best)
    return not gain.pays or gain.nats < LEAST


def _nothing_selected(selection: Selection) -> Selection:
    """Nothing, where left-out data do not support the best hypothesis."""
    remark = (
        f"{' and '.join(selection.best)} would fit these readings better, but left-out data are "
        "predicted as well without: it may be chance"
    )
    none = selection.without(selection.best, NULL)
    return replace(none, remarks=(*selection.remarks, remark), unsupported=True)


def as_good(search: Search, hypothesis: Hypothesis, best: Hypothesis) -> bool:
    """Whether a hypothesis predicts left-out data as well as the `best`: within one standard error
    of it, or with less than any evidence between them."""
    gain = window_gain(search, best, hypothesis)
    return not gain.pays or gain.nats < LEAST


def selected(search: Search, best: Hypothesis, p_value: float) -> Selection:
    """The best hypothesis without what is not significant, too small, refuted by left-out data or
    of no use there."""
    if not best or p_value > DiscoverSettings.significant:
        return Selection(NULL, p_value)
    selection = Selection(best, p_value)
    while selection.best:
        best = selection.best
        large = material(search, best)
        if large != best:
            selection = selection.without(best, large)
            if large:
                search.visit(large)
            continue
        against = likeliest_part(search, best)
        if is_refuted(search, best, against):
            selection = selection.without(best, against)
            continue
        simpler = simplest(search, selection)
        if simpler.best != best:
            selection = simpler
        else:
            return _nothing_selected(simpler) if is_unsupported(search, best) else simpler
    return selection


def is_refuted(search: Search, hypothesis: Hypothesis, against: Hypothesis) -> bool:
    """Whether rows of left-out blocks speak for the smaller hypothesis, or for several effects no
    more than they scatter."""
    gain = left_out(search, hypothesis, against)
    return gain.refuted or (len(hypothesis) > 1 and not gain.pays)


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


ANY = 1.0  # nats that are any evidence at all
STRONG = 5.0  # nats of strong evidence, by Kass and Raftery 1995
SAME = 2e-3  # share of an error by which it must change to have changed: rounding of the fit


def predictive(search: Search, best: Hypothesis, likeliest: Hypothesis) -> Hypothesis:
    """The selected effects, and those that help to predict folds of the fitted logs: of the
    likeliest hypothesis, and others for which there is strong evidence beside the selected ones."""
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
    search: Search, selection: Selection, whole: Hypothesis, kept: HeldOut | None
) -> tuple[Selection, Hypothesis]:
    """Selection and written effects without those that raise the error on logs `kept` for quoting;
    one that leaves it as it was is written, but not selected. All at their joint estimates."""
    best = tuple(e for e in selection.best if e in whole)
    if kept is None or not whole:
        return (replace(selection, best=best) if best else selection), whole
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
    if best == selection.best:
        return selection, whole
    return (
        replace(selection, best=best) if best else _nothing_selected(selection)
    ), whole if best else ()


def certain(selection: Selection, joint: JointFit, problem: Problem) -> Selection:
    """The selection without effects that its joint fit leaves room to be absent, as long as any is
    left: they are likely, and not sure. Whether there is anything is asked by the bootstrap."""
    candidates = (problem.candidates[e] for e in selection.best)
    best = tuple(c.effect for c in candidates if not joint.holds_absence(c))
    return replace(selection, best=best) if best else selection


def that_show(search: Search, best: Hypothesis, whole: Hypothesis, joint: JointFit) -> Hypothesis:
    """The written effects without those beside the selected ones that are too small to matter in
    their joint fit, or leave the error on left-out data as it is, to the two decimals that are
    quoted."""
    for effect in (e for e in reversed(whole) if e not in best):
        part = tuple(e for e in whole if e != effect)
        if not part or search.late:
            break
        search.visit(part)
        before, after = (round(left_out_error(search, h), 2) for h in (part, whole))
        small = joint.share(search.problem.candidates[effect]) < DiscoverSettings.matters
        whole = part if small or before <= after else whole
    return whole


def _joint(search: Search, hypothesis: Hypothesis) -> dict[str, float]:
    """The joint estimate of a hypothesis, which is refitted first."""
    search.visit(hypothesis)
    return joint_estimate(search.problem, hypothesis, search.points[hypothesis].fit.theta)
