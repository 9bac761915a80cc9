"""From a problem to an answer: search for effects, then doubt what was found."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from kemba.identify.answer import (
    ENDED,
    HELD_OUT,
    Answer,
    DiscoverSettings,
    Ranked,
    VerdictSettings,
    phrase,
)
from kemba.identify.infer.cross_validation import HeldOut, error, one_part_shows
from kemba.identify.infer.formula import Formula, look
from kemba.identify.infer.joint import JointFit, joint_fit, without_figure_aliases
from kemba.identify.infer.linear import NULL, Hypothesis
from kemba.identify.infer.search import STRUCTURAL, Search
from kemba.identify.infer.selection import (
    Selection,
    certain,
    material,
    predictive,
    quoted,
    selected,
    that_show,
)
from kemba.identify.infer.significance import (
    Identifiability,
    NullTest,
    best_gain,
    identifiability,
    null_test,
    smallest_detectable,
)
from kemba.identify.infer.structure import (
    Rebuilt,
    ahead,
    fitted_figures,
    is_mixture,
    joined,
    structure_row,
)
from kemba.identify.infer.verdict import (
    Caveats,
    caveats_of,
    fitted_errors,
    implausible,
    is_sure,
    ladder,
    ranked,
    rest_of,
    values,
    verdict_on,
)
from kemba.identify.infer.windows import error_ratio
from kemba.identify.problem.problem import Problem
from kemba.stopwatch import Tell, silent

WRITTEN = ("missing", "partly")  # verdicts that give a model


@dataclass(frozen=True)
class Discovery:
    """A finished search and what was made of it.

    `best`: the effects of the model that is written, at their `joint` estimate. `fitted`: errors on
    the fitted logs at every step of the answer's `ladder`.
    """

    answer: Answer
    search: Search
    best: Hypothesis
    kept: HeldOut | None = None
    fitted: tuple[float, ...] = ()
    joint: JointFit | None = None


def discover(
    problem: Problem,
    holdout: Problem | None = None,
    time_limit: float = np.inf,
    say: Tell = silent,
) -> Discovery:
    """Which effect is missing from the model behind `problem`, if any.

    `holdout`: other logs, on which the answer is judged; `time_limit` [s]; `say`: told of progress.
    """
    started = time.monotonic()
    share = DiscoverSettings.searching
    search = Search(problem, started + share * time_limit, say, due=started + time_limit)
    search.start()
    say(what_shows(search, null_test(search)).sentence)
    found = _discovered(search, search.first(), holdout)
    found.answer.runtime_s = time.monotonic() - started
    return found


def what_shows(search: Search, test: NullTest) -> Identifiability:
    """What the logs of a prepared search can tell, about the null model."""
    ranker = search.base.ranker(search.points[NULL].linear)
    return identifiability(ranker, smallest_detectable(ranker, test.threshold))


def _discovered(search: Search, guess: Hypothesis, holdout: Problem | None) -> Discovery:
    """The answer from a first guess on, of this structure or another that leaves far less."""
    guessed = search.problem.structures & set(guess)
    least = 0.0 if guessed else STRUCTURAL
    theta = search.points[guess].fit.theta
    other = None if search.ended else ahead(search.problem, theta, least)
    rebuilt = _with_structure(search, other, holdout) if other else None
    if rebuilt and (rebuilt.answer.verdict == "missing" or search.ended):
        return rebuilt
    first = judged(search, search.further(guess), holdout)
    named = search.problem.structures & set(first.best)
    mixed = any(is_mixture(values(search, first.best, s)["a"]) for s in named)
    if rebuilt is None:
        whole = first.answer.verdict == "missing" and not mixed
        if whole or not named or search.ended:
            return first
        built = fitted_figures(search.problem.recolour(None).rebuilt({}))
        rebuilt = _with_structure(search, Rebuilt(*built), holdout)
    if mixed and rebuilt.answer.verdict == "missing":
        return rebuilt
    # one noise for both, or the model that takes more of its error for noise would look better
    judge = (first.kept.found if first.kept else search.problem).with_noise_of(
        rebuilt.search.problem
    )
    left = error_ratio(judge, search.points[first.best].fit.theta)
    return rebuilt if rebuilt.answer.error_after < left else first


def _with_structure(search: Search, other: Rebuilt, holdout: Problem | None) -> Discovery:
    """What a model with the other structure lacks."""
    (structure,) = search.problem.structures
    search.say(f"building the model anew with {structure}")
    search.visit((structure,))
    second = Search(other.problem, search.deadline, search.say, begin=other.figures, due=search.due)
    built = holdout.rebuilt({}).relinearise(other.figures) if holdout else None
    found = judged(second, second.run(), built)
    # one noise for all rungs: that of the model that explains more of the data
    judge = (holdout or search.problem).with_noise_of(second.problem)
    before = error_ratio(judge, search.points[NULL].fit.theta)
    alone = error(second, NULL, found.kept)
    fit = second.points[found.best].fit.theta
    joint = found.joint or joint_fit(second.problem, found.best, fit)
    row = structure_row(search, structure, (before, alone), second, joint, other.nats)
    gain = max(best_gain(search), other.nats)
    answer = joined(row, null_test(search).p_value(gain), found.answer, second, found.best)
    first_error = search.points[NULL].fitted_error
    search.say(f"built anew, the error is {answer.error_after:.2f} times the noise")
    fitted = (first_error, *found.fitted)
    _add(answer, joint)
    return replace(found, answer=answer, fitted=fitted, joint=joint)


def judged(search: Search, best: Hypothesis, holdout: Problem | None = None) -> Discovery:
    """What the finished `search` with its `best` hypothesis allows to say."""
    ended, search.in_pieces = search.ended, one_part_shows(search, best)
    search.say("simulating logs in which nothing is missing")
    test, likeliest = null_test(search), best
    selection = selected(search, likeliest, test.p_value(best_gain(search)))
    search.say("testing whether more is missing")
    kept = HeldOut.beside(holdout, search.problem) if holdout else None
    whole = predictive(search, selection.best, likeliest) if selection.best else NULL
    whole = without_figure_aliases(search.problem, whole, search.points[whole].fit.theta)
    selection, whole = quoted(search, selection, whole, kept)
    joint, fitted = None, NULL
    while whole != fitted:
        search.say("fitting all that was found together")
        joint = joint_fit(search.problem, whole, search.points[whole].fit.theta)
        selection = certain(selection, joint, search.problem)
        fitted, whole = whole, that_show(search, selection.best, whole, joint)
    best, p_value, ended = selection.best, selection.p_value, ended or search.late
    for hypothesis in filter(None, (best, whole)):
        search.visit(hypothesis)
    if test.too_short:
        return _undecided(search, test, kept)
    # what is too small to be reported still explains: a formula must do better than with it
    slight = best and material(search, likeliest) == best
    formula = look(search, likeliest if slight else best)
    caveats = Caveats((ENDED,) if ended else ())
    if formula is None:
        caveats = caveats_of(search, selection, kept, ended)
    if whole and verdict_on(best, formula, caveats) not in WRITTEN:
        joint = None
    if not best and formula is None and not caveats.reasons:
        joint = joint_fit(search.problem, NULL, search.points[NULL].fit.theta)
    if gross := implausible(search, whole if joint else best, joint):
        caveats, joint = Caveats(gross), None
    whole = whole if joint else best
    search.say("ranking the effects")
    ranking = ranked(search, selection, kept, whole, joint)
    answer = _answer(search, best, p_value, test, ranking, formula, kept, caveats, whole)
    answer.remarks = [*answer.remarks, *selection.remarks]
    if joint is not None:
        _add(answer, joint)
        answer.remarks += joint.remarks
    if selection.unsupported and answer.verdict == "nothing":
        answer.idle = True
        answer.sentence = phrase(answer)
    if ended and ENDED not in answer.remarks:
        answer.remarks = [*answer.remarks, ENDED]
    return Discovery(answer, search, whole, kept, fitted_errors(search, whole), joint)


def _add(answer: Answer, joint: JointFit) -> None:
    """Figures of the joint fit, as they are written."""
    answer.figures, answer.machine = joint.figures, joint.machine
    answer.covariance = joint.matrix


def _undecided(search: Search, test: NullTest, kept: HeldOut | None) -> Discovery:
    """What logs tell that are too short for significance: whether something differs, not what."""
    gain, caveats = best_gain(search), Caveats()
    differs = test.share(gain) <= DiscoverSettings.significant
    if differs or error(search, NULL, kept) > VerdictSettings.whole:
        piece = DiscoverSettings.fine
        caveats = Caveats((f"they hold {test.blocks} pieces of {piece:g} s, and chance alone needs "
                         f"{test.needed} to be ruled out",))  # fmt: skip
    ranking = ranked(search, Selection(), kept)
    answer = _answer(search, NULL, test.p_value(gain), test, ranking, None, kept, caveats)
    if caveats.reasons:
        answer.next = f"record at least {(test.needed + 1) * DiscoverSettings.fine:.1f} s"
        answer.sentence = phrase(answer)
    return Discovery(answer, search, NULL, kept, fitted_errors(search, NULL))


def _answer(
    search: Search,
    best: Hypothesis,
    p_value: float,
    test: NullTest,
    ranking: Sequence[Ranked],
    formula: Formula | None,
    kept: HeldOut | None,
    caveats: Caveats,
    whole: Hypothesis = NULL,
) -> Answer:
    problem = search.problem
    by_run = len(problem.runs) > 3 and not search.in_pieces
    before = error(search, NULL, kept)
    after = error(search, whole, kept) if whole else before
    verdict = verdict_on(best, formula, caveats)
    rows = {r.effect: r for r in ranking}
    named = tuple(effect for effect in rows if effect in best)
    sure = tuple(r for r in named if r not in caveats.unsure and is_sure(rows[r]))
    added = tuple(effect for effect in rows if effect in whole) if verdict in WRITTEN else ()
    told = what_shows(search, test)
    answer = Answer(
        verdict=verdict,
        p_value_nothing=min(p_value, formula.p_value) if formula else p_value,
        ranking=ranking,
        added=added,
        sure={"missing": named, "partly": sure}.get(verdict, ()),
        error_before=before,
        error_after=after,
        smallest_detectable={
            e: {problem.candidates[e].lead.name: size} for e, size in told.sizes.items()
        },
        alike=told.alike,
        formula=str(formula) if formula else None,
        split_by=HELD_OUT if kept else "runs" if by_run else "time blocks",
        ladder=ladder(search, whole, kept),
    )
    answer.remarks = list(caveats.reasons)
    if verdict == "partly":
        doubted = [e for e in named if e not in sure]
        answer.rest, answer.next = rest_of(search, whole or best, doubted)
    answer.sentence = phrase(answer)
    return answer
