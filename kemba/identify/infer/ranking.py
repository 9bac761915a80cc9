"""The effects in order of probability, with their parameters and their equivalents."""

from itertools import pairwise

import numpy as np

from kemba.identify.answer import Ranked, Value
from kemba.identify.infer.cross_validation import HeldOut, error, error_as_it_is, left_out
from kemba.identify.infer.joint import JointFit
from kemba.identify.infer.linear import is_shape
from kemba.identify.infer.null_model import within_bounds
from kemba.identify.infer.search import Search
from kemba.identify.infer.selection import Selection, strength
from kemba.identify.infer.spike_slab import NULL, Hypothesis, SpikeSlabSettings, share_of

# two explanations are equivalent when their evidence differs by less [nats]: Kass and Raftery
# 1995, 'strong' evidence begins at 3 nats
SAME = 3.0
SHOWN = 8  # effects in the ranking: fits a screen
# largest probability of all effects together where nothing is significant: nothing is then the
# likeliest
DOUBTED = 0.5


def ranked(
    search: Search,
    selection: Selection,
    kept: HeldOut | None,
    whole: Hypothesis = NULL,
    joint: JointFit | None = None,
) -> list[Ranked]:
    """The effects in order of probability; those of the selected hypothesis first, then the
    others of the `whole` that is written, with what the `joint` fit says of them."""
    problem, best = search.problem, selection.best
    probability = search.probabilities(selection.dismissed if best else ())
    if not best:  # where nothing was found significant, nothing is the likeliest
        rest = sum(p for h, p in probability.items() if h)
        scale = min(1.0, DOUBTED / rest) if rest > 0 else 1.0
        probability = {h: p * scale if h else 1.0 - rest * scale for h, p in probability.items()}
    shares = share_of(probability, problem.candidates)
    order = sorted(
        shares,
        key=lambda e: (e not in best, e not in whole, -strength(search, e, best), -shares[e]),
    )
    found = []
    before = error(search, NULL, kept)
    for effect in order[: max(SHOWN, len(whole))]:
        written = joint is not None and effect in whole
        hypothesis = (whole if written else best) if effect in {*whole, *best} else NULL
        hypothesis = hypothesis or _likeliest_with(search, effect)
        if not hypothesis:
            continue
        if joint is not None and written:
            told = joint.values(problem.candidates[effect])
        else:
            told = values(search, hypothesis, effect)
        alike = equivalents(search, selection, effect) if effect in best else ()
        after, gain = error(search, hypothesis, kept), left_out(search, hypothesis).nats
        found.append(Ranked(effect, shares[effect], told, alike, before, after, gain))
    return found


def _likeliest_with(search: Search, effect: str) -> Hypothesis:
    """This effect alone, if it was refitted; else the likeliest hypothesis that has it."""
    if (effect,) in search.points:
        return (effect,)
    having = [h for h in search.points if effect in h]
    return max(having, key=lambda h: search.points[h].log_evidence, default=NULL)


def equivalents(search: Search, selection: Selection, effect: str) -> tuple[str, ...]:
    """Effects that could stand in this one's place in the answer: they explain the data, or predict
    left-out data, as well."""
    hypothesis = selection.best
    own, same = search.points[hypothesis].log_evidence, SAME
    near = {h for h, p in search.points.items() if own - p.log_evidence < same}
    rest = set(hypothesis) - {effect}
    found: set[str] = set()
    for other in (near - selection.dismissed) | set(selection.rivals):
        swapped = set(other) - rest
        if len(other) == len(hypothesis) and rest <= set(other) and swapped != {effect}:
            found |= swapped
    return tuple(sorted(found))


def values(search: Search, hypothesis: Hypothesis, effect: str) -> dict[str, Value]:
    """Parameters of one effect with 95 % intervals.

    The model's own imperfection may add to an effect or hide some of it: as much, in one sigma, as
    the spike of the prior allows.
    """
    problem, candidate = search.problem, search.problem.candidates[effect]
    point, found = search.points[hypothesis], {}
    z, covariance = within_bounds(problem, point), point.score.covariance
    for key, parameter in candidate.keys().items():
        i, shape = point.linear.index(key), is_shape(problem, key)  # shapes by their logarithm
        step = 1.0 if shape else abs(z[i] - parameter.off)
        reach = 1.96 * float(np.hypot(np.sqrt(covariance[i, i]), SpikeSlabSettings.spike * step))
        triple = z[i] + reach * np.array([0.0, -1.0, 1.0])
        if shape:
            triple = np.exp(np.clip(triple, -50, 50))
        triple = np.clip(triple, parameter.lower, parameter.upper)
        name, unit = candidate.reported(parameter)
        if name != parameter.name:
            triple = 1.0 / np.maximum(triple, 1e-12)[[0, 2, 1]]
        value, low, high = triple.tolist()
        found[name] = Value(value, low, high, unit)
    return found


def rungs(search: Search, best: Hypothesis) -> list[Hypothesis]:
    """Nothing, then the effects of the best answer as they join, the strongest first; parts that
    were not refitted are passed over."""
    order = sorted(best, key=lambda e: -strength(search, e, best))
    parts = [tuple(sorted(order[: i + 1])) for i in range(len(order))]
    return [NULL, *(part for part in parts if part in search.points)]


def ladder(search: Search, best: Hypothesis, kept: HeldOut | None) -> list[tuple[str, float]]:
    """Error on unseen data at every rung, by what joins there."""
    steps, names = rungs(search, best), ["model as it is"]
    for before, after in pairwise(steps):
        names.append(" + ".join(e for e in after if e not in before))
    return [(n, error(search, step, kept)) for n, step in zip(names, steps, strict=True)]


def fitted_errors(search: Search, best: Hypothesis) -> tuple[float, ...]:
    """Error on the fitted logs at every rung of the ladder."""
    first, *others = (search.points[step].fitted_error for step in rungs(search, best))
    return (error_as_it_is(search) if search.own else first, *others)
