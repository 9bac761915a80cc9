"""From a problem to an answer: search, doubt, confirm."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from kemba.identify.answer import SIGNIFICANT, Answer, Ranked, Value, phrase
from kemba.identify.doubt.cross_validation import left_out, left_out_error
from kemba.identify.doubt.run_consistency import Drift, drifting
from kemba.identify.doubt.unexplained import Formula, look, unfinished
from kemba.identify.evidence.bootstrap import NullTest, bootstrap, smallest_detectable
from kemba.identify.evidence.linear import is_shape, time_blocks
from kemba.identify.evidence.problem import Array, Candidate, Problem
from kemba.identify.evidence.search import Search, share_of
from kemba.identify.evidence.spike_slab import NULL, SPIKE_WIDTH, Hypothesis
from kemba.identify.evidence.windows import error_ratio

CLASS = 3.0  # nats within which two explanations are the same to these data
MATTERS = 0.2  # an effect below this share of its size is no finding,
MATTERS_TOO = 0.3  # nor is one beside a stronger one
DEFECT = (
    SPIKE_WIDTH  # share of an effect that the model's own imperfection may add or hide, 1 sigma
)
FINE = 0.1  # s, blocks whose signs are redrawn
UNEXPLAINED, LEFT = 1.3, 0.9  # noise units and share of the error that no answer may leave
SHOWN = 8

Talk = Callable[[str], None]


@dataclass(frozen=True)
class Discovery:
    """A finished search and what was made of it."""

    answer: Answer
    search: Search
    best: Hypothesis
    holdout: Problem | None = None


def discover(
    problem: Problem,
    holdout: Problem | None = None,
    time_limit: float = np.inf,
    say: Talk = lambda text: None,
) -> Discovery:
    """Which effect is missing from the model behind `problem`, if any."""
    started = time.monotonic()
    search = Search(problem, started + 0.8 * time_limit, say)
    best = search.run()
    say("asking whether nothing would look like this")
    test = null_test(search)
    best, p_value, dismissed = _believed(search, best, test)
    formula = look(search, best)
    drift = drifting(search, best)
    if drift is not None and formula is not None and drift.nats > formula.gain:
        formula = None
    doubts = [] if formula else doubts_about(search, best, drift, holdout)
    ranking = ranked(search, best, dismissed, holdout)
    answer = _answer(search, best, p_value, test, ranking, formula, holdout, doubts)
    answer.runtime_s = time.monotonic() - started
    return Discovery(answer, search, best, holdout)


def null_test(search: Search) -> NullTest:
    """The bootstrap of the search, with the noise these data have."""
    base = search.base
    blocks = time_blocks(search.problem, shortest=FINE)
    left = base.residual + base.jacobian @ (base.flexible_fit() - base.point.linear.at)
    pieces = base.jacobian * left[:, None]
    order = np.argsort(blocks, kind="stable")
    edges = np.flatnonzero(np.diff(blocks[order], prepend=-1))
    noise = np.add.reduceat(pieces[order], edges, axis=0)
    singles = [(name,) for name in search.problem.candidates]
    return bootstrap(base.ranker(base.point.linear), noise, singles)


def _believed(
    search: Search, best: Hypothesis, test: NullTest
) -> tuple[Hypothesis, float, set[Hypothesis]]:
    """The best hypothesis cut down to what is significant and holds on left-out data, the p-value
    of nothing, and what was dismissed on the way."""
    null = search.points[NULL].log_evidence
    singles = [p.log_evidence - null for h, p in search.points.items() if h]
    p_value = test.p_value(max(singles, default=0.0))
    dismissed: set[Hypothesis] = set()
    if not best or p_value > SIGNIFICANT:
        return NULL, p_value, dismissed
    while best:
        grave = material(search, best)
        if grave != best:
            dismissed.add(best)
            best = grave
            if best:
                search.visit(best)
            continue
        smaller = [h for h in search.points if len(h) == len(best) - 1 and set(h) < set(best)]
        against = max(smaller, key=lambda h: search.points[h].log_evidence, default=NULL)
        if not left_out(search, best, against).refuted:
            return best, p_value, dismissed
        dismissed.add(best)
        best = against
    return NULL, p_value, dismissed


def material(search: Search, hypothesis: Hypothesis) -> Hypothesis:
    """Those of its effects that are large enough to be more than an imperfection."""
    score, linear = search.points[hypothesis].score, search.points[hypothesis].linear
    least = MATTERS if len(hypothesis) == 1 else MATTERS_TOO

    def share(effect: str) -> float:
        c = search.problem.candidates[effect]
        return float(abs(score.z[linear.index(c.key)] - c.lead.off) / c.lead.size)

    strongest = max(hypothesis, key=lambda e: _strength(search, e, hypothesis))
    return tuple(e for e in hypothesis if share(e) >= (MATTERS if e == strongest else least))


def doubts_about(
    search: Search, best: Hypothesis, drift: Drift | None, holdout: Problem | None
) -> list[str]:
    """Why the best answer cannot be the whole of it."""
    if drift is not None:
        return [str(drift)]
    if unfinished(search, best):
        return ["the error that is left repeats itself with motion and valves"]
    before, after = (error(search, h, holdout) for h in (NULL, best))
    if best and after > max(UNEXPLAINED, LEFT * before):
        return [
            f"{' and '.join(best)} fits best, but leaves an error of {after:.3g} times the noise"
        ]
    return []


def _answer(
    search: Search,
    best: Hypothesis,
    p_value: float,
    test: NullTest,
    ranking: Sequence[Ranked],
    formula: Formula | None,
    holdout: Problem | None,
    doubts: Sequence[str] = (),
) -> Answer:
    problem = search.problem
    before = error(search, NULL, holdout)
    after = error(search, best, holdout) if best else before
    verdict = "unknown" if formula or doubts else "missing" if best else "nothing"
    ranker = search.base.ranker(search.points[NULL].linear)
    sizes = smallest_detectable(ranker, test.threshold)
    answer = Answer(
        verdict=verdict,  # type: ignore[arg-type]
        p_value_nothing=p_value if not formula else min(p_value, float(np.exp(-formula.gain))),
        ranking=ranking,
        added=tuple(r.effect for r in ranking if r.effect in best) if verdict == "missing" else (),
        error_before=before,
        error_after=after,
        smallest_detectable={
            effect: {problem.candidates[effect].lead.name: size} for effect, size in sizes.items()
        },
        formula=str(formula) if formula else None,
        split_by="held-out logs" if holdout else "runs" if len(problem.runs) > 3 else "time blocks",
        ladder=_ladder(search, best, holdout),
    )
    answer.remarks = list(doubts)
    answer.sentence = phrase(answer)
    return answer


def error(search: Search, hypothesis: Hypothesis, holdout: Problem | None) -> float:
    """Error in units of the noise on data that the fit has not seen: the one number that sentence,
    ranking, ladder and figures show. Of the held-out logs; without any, of left-out blocks."""
    if holdout is None:
        return left_out_error(search, hypothesis)
    unknown = set(holdout.nuisance) - set(search.problem.nuisance)  # of sensors not seen before
    return error_ratio(holdout, search.points[hypothesis].fit.theta, unknown)


def ranked(
    search: Search, best: Hypothesis, dismissed: set[Hypothesis], holdout: Problem | None
) -> list[Ranked]:
    """The effects in order of probability; those of the best answer first."""
    problem = search.problem
    probability = search.probabilities(dismissed) if best else _doubted(search.probabilities())
    shares = share_of(probability, problem.candidates)
    order = sorted(shares, key=lambda e: (e not in best, -_strength(search, e, best), -shares[e]))
    found = []
    before = error(search, NULL, holdout)
    for effect in order[:SHOWN]:
        hypothesis = best if effect in best else (effect,)
        point = search.points.get(hypothesis)
        if point is None:
            continue
        found.append(
            Ranked(
                effect,
                shares[effect],
                values(search, hypothesis, effect),
                equivalents(search, hypothesis, effect) if effect in best else (),
                before,
                error(search, hypothesis, holdout),
                left_out(search, hypothesis).nats,
            )
        )
    return found


def _doubted(probability: Mapping[Hypothesis, float]) -> dict[Hypothesis, float]:
    """Where nothing was found significant, nothing is the likeliest."""
    rest = sum(p for h, p in probability.items() if h)
    scale = min(1.0, 0.5 / rest) if rest > 0 else 1.0
    return {h: p * scale if h else 1.0 - rest * scale for h, p in probability.items()}


def _strength(search: Search, effect: str, best: Hypothesis) -> float:
    """How much evidence goes when this effect is taken out of the answer."""
    if effect not in best:
        return 0.0
    rest = tuple(h for h in best if h != effect)
    points = search.points
    return points[best].log_evidence - points[rest].log_evidence if rest in points else 0.0


def equivalents(search: Search, hypothesis: Hypothesis, effect: str) -> tuple[str, ...]:
    """Effects that could stand in this one's place and explain the data as well."""
    own = search.points[hypothesis].log_evidence
    rest = set(hypothesis) - {effect}
    found = []
    for other, point in search.points.items():
        swapped = set(other) - rest
        if len(other) == len(hypothesis) and rest < set(other) | {""} and len(swapped) == 1:
            (name,) = swapped
            if name != effect and rest <= set(other) and own - point.log_evidence < CLASS:
                found.append(name)
    return tuple(sorted(found))


def values(search: Search, hypothesis: Hypothesis, effect: str) -> dict[str, Value]:
    """Parameters of one effect with 95 % intervals."""
    point, candidate = search.points[hypothesis], search.problem.candidates[effect]
    found = {}
    for key, parameter in candidate.keys().items():
        i = point.linear.index(key)
        centre, sd = point.score.z[i], float(np.sqrt(point.score.covariance[i, i]))
        step = 1.0 if is_shape(search.problem, key) else abs(centre - parameter.off)
        sd = float(np.hypot(sd, DEFECT * step))
        low, high = centre - 1.96 * sd, centre + 1.96 * sd
        triple = np.array([centre, low, high])
        if is_shape(search.problem, key):
            triple = np.exp(np.clip(triple, -50, 50))
        triple = np.clip(triple, parameter.lower, parameter.upper)
        name, unit, triple = reported(candidate, parameter.name, parameter.unit, triple)
        value, low, high = (float(t) for t in triple)
        found[name] = Value(value, low, high, unit)
    return found


def reported(candidate: Candidate, name: str, unit: str, triple: Array) -> tuple[str, str, Array]:
    """A parameter as the catalogue names it, also where it was searched reciprocally."""
    if name not in candidate.reciprocal:
        return name, unit, triple
    name, unit = candidate.reciprocal[name]
    value, low, high = 1.0 / np.maximum(triple, 1e-12)
    return name, unit, np.array([value, high, low])


def rungs(search: Search, best: Hypothesis) -> list[Hypothesis]:
    """Nothing, then the effects of the best answer as they join, the strongest first; parts that
    were not refitted are passed over."""
    order = sorted(best, key=lambda e: -_strength(search, e, best))
    parts = [tuple(sorted(order[: i + 1])) for i in range(len(order))]
    return [NULL, *(part for part in parts if part in search.points)]


def _ladder(search: Search, best: Hypothesis, holdout: Problem | None) -> list[tuple[str, float]]:
    """Error on unseen data at every rung, by what joins there."""
    steps, names = rungs(search, best), ["model as it is"]
    for before, after in pairwise(steps):
        names.append(" + ".join(e for e in after if e not in before))
    return [(n, error(search, step, holdout)) for n, step in zip(names, steps, strict=True)]
