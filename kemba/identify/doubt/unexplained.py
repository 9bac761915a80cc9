"""Errors that no effect of the catalogue explains: simple terms, judged by the same evidence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from kemba.identify.doubt.drifts import drift_columns
from kemba.identify.evidence.linear import Linear, condense
from kemba.identify.evidence.search import Search
from kemba.identify.evidence.spike_slab import NULL, Hypothesis, Ranker
from kemba.identify.problem.problem import Array, Candidate, Labels, Parameter
from kemba.identify.settings import DiscoverSettings
from kemba.settings import BY_HAND, Settings, setting


class UnexplainedSettings(Settings):
    """When something is missing that the catalogue does not have."""

    width: float = setting(
        10.0,
        "1",
        "prior of a term's force, in sigmas of the noise where it acts most",
        BY_HAND,
        decides=True,
    )
    terms: int = setting(2, "1", "most terms of a formula", "convention: a formula can be read")
    structure: float = setting(
        1.0,
        "1",
        "repeatable mean square, in noise units, that an imperfect model may leave",
        BY_HAND,
        decides=True,
    )
    left: float = setting(
        0.1, "1", "the same as a share of what the answer explains", BY_HAND, decides=True
    )
    matters: float = setting(
        0.2,
        "1",
        "smallest force of a formula, as a share of what matters in practice",
        BY_HAND,
        decides=True,
    )
    clip: float = setting(30.0, "1", "residuals are clipped at so many sigmas", BY_HAND)
    ridges: tuple[float, ...] = setting(
        (1e-4, 1e-2, 1.0), "1", "penalties of the regression that are tried", BY_HAND
    )
    folds: int = setting(5, "1", "blocks of time that are left out in turn", "convention: five")
    no_force: float = setting(
        1e-9, "1", "force, in sigmas, of a term that acts nowhere", "convention: zero"
    )


def structured(search: Search, hypothesis: Hypothesis) -> tuple[float, float]:
    """Mean square of the residual in noise units, and the part of it that repeats itself.

    A regression on everything that a force could depend on is learnt on some blocks of time. What
    it predicts in the other blocks is structure: noise cannot be predicted, however coloured.
    """
    settings = UnexplainedSettings.current()
    left_over = search.problem.leftover(search.points[hypothesis].fit.theta)
    if left_over is None:
        return 1.0, 0.0
    r = np.clip(left_over.residual, -settings.clip, settings.clip)
    columns = left_over.features
    columns = columns / np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-9)
    folds = _folds(left_over.run)
    power = float(np.mean(r**2))
    left = min(
        float(np.mean((r - _predicted_folds(r, columns, folds, k)) ** 2)) for k in settings.ridges
    )
    return power, max(power - left, 0.0)


def _predicted_folds(r: Array, columns: Array, folds: Labels, ridge: float) -> Array:
    """Residual (n,) that a ridge regression on the other folds predicts for each fold.

    `columns` (n, m): regressors; `folds` (n,): fold of each row.
    """
    predicted = np.zeros(len(r))
    for fold in np.unique(folds):
        out = folds == fold
        a, b = columns[~out], r[~out]
        h = a.T @ a + ridge * len(a) * np.eye(a.shape[1])
        predicted[out] = columns[out] @ np.linalg.solve(h, a.T @ b)
    return predicted


def _folds(run: Labels) -> Labels:
    """Which fold each row (n,) belongs to: runs are cut into blocks of time, dealt out in turn."""
    folds = UnexplainedSettings.current().folds
    labels = np.zeros(len(run), dtype=int)
    for i in np.unique(run):
        own = np.flatnonzero(run == i)
        labels[own] = np.arange(len(own)) * 2 * folds // len(own) % folds
    return labels


def unfinished(search: Search, best: Hypothesis) -> bool:
    """Whether so much structure is left that the answer cannot be complete."""
    settings = UnexplainedSettings.current()
    power, structure = structured(search, best)
    if not best or structure <= settings.structure:
        return structure > settings.structure
    before, _ = structured(search, NULL)
    return structure > settings.left * max(before - power, 0.0)


def explains_structure(search: Search, best: Hypothesis) -> bool:
    """Whether an answer leaves hardly any of the error that repeats itself without it: of a lost
    force of 20 N 0.4 %, of a wrong supply that stands for something else all of it."""
    before, after = (structured(search, h)[1] for h in (NULL, best))
    return after < UnexplainedSettings.current().left * before


@dataclass(frozen=True)
class Formula:
    """A force as a sum of simple terms.

    `candidates`: names of the `terms` in their ranker; `coefficients`: value and sigma of each
    term; `gain` [nats]: log evidence that they add.
    """

    candidates: Hypothesis
    terms: tuple[str, ...]
    coefficients: tuple[tuple[float, float], ...]
    gain: float

    def __str__(self) -> str:
        return "F = " + " + ".join(
            f"({c:.4g} +- {1.96 * s:.2g})*({t})"
            for t, (c, s) in zip(self.terms, self.coefficients, strict=True)
        )


def extended(
    search: Search, linear: Linear, jacobian: Array, r: Array, formulas: Mapping[str, Array]
) -> tuple[Ranker, dict[str, str]]:
    """A ranker with these formulas as further candidates, and name of a candidate -> formula.

    Beside them every sensor may drift: a formula is what no drift explains.
    `jacobian` (n, k) and `r` (n,) as in `linear`; `formulas`: columns (n,).
    """
    settings = UnexplainedSettings.current()
    names = {f"term{i}": formula for i, formula in enumerate(formulas)}
    columns = np.stack([formulas[f] for f in names.values()], axis=1)
    reach = np.percentile(np.abs(columns), 99, axis=0)
    widths = settings.width / np.maximum(reach, settings.no_force)
    keep = [i for i in range(len(names)) if reach[i] > settings.no_force]
    names = {n: f for i, (n, f) in enumerate(names.items()) if i in keep}
    columns, widths = columns[:, keep], widths[keep]
    candidates = {
        n: Candidate(n, Parameter("c", size=float(w))) for n, w in zip(names, widths, strict=True)
    }
    drifts, sigmas = drift_columns(search.problem)
    zeros = np.zeros(len(widths) + len(sigmas))
    keys = [*(c.key for c in candidates.values()), *(f"drift{i}" for i in range(len(sigmas)))]
    joined = condense(
        (*linear.names, *keys),
        np.concatenate([linear.at, zeros]),
        np.concatenate([linear.mean, zeros]),
        np.concatenate([linear.width, widths, sigmas]),
        np.concatenate([jacobian, columns, drifts], axis=1),
        r,
        search.base.division.blocks,
    )
    problem = search.problem
    known = {**problem.candidates, **candidates}
    return Ranker(joined, known, problem.nuisance, silent=candidates), names


def by_chance(count: int) -> float:
    """Gain [nats] that the best of `count` terms reaches by chance at most as often as a p-value
    may be significant.

    A Bayes factor exceeds exp(g) with a probability of exp(-g) at most where its term is not there
    (Markov's inequality); `count` of them do so with `count` times that probability at most.
    """
    return float(np.log(count / DiscoverSettings.current().significant))


def look(search: Search, best: Hypothesis) -> Formula | None:
    """The formula that explains what the best catalogue answer cannot, if there is one."""
    null = search.points[NULL]
    formulas = search.problem.formulas(null.fit.theta)
    if not formulas:
        return None
    ranker, names = extended(
        search, null.mode.linear, search.base.jacobian, null.mode.residual, formulas
    )
    chosen = _matters(search, _formula(ranker, names, _grow(ranker, names)))
    alone = _formula(ranker, names, chosen)
    catalogue = search.points[best].log_evidence - null.log_evidence
    if chosen and alone.gain > catalogue + by_chance(len(names)):
        return replace(alone, gain=alone.gain - catalogue)
    return None


def _matters(search: Search, formula: Formula) -> Hypothesis:
    """Those terms of a formula that are more than the imperfection that every model has: a small
    one beside a large one would let the formula look better than the effect that is there."""
    problem, theta = search.problem, search.points[NULL].fit.theta
    parts = zip(formula.candidates, formula.terms, formula.coefficients, strict=True)
    least = UnexplainedSettings.current().matters
    return tuple(n for n, term, (c, _) in parts if problem.weight(theta, term, c) > least)


def _grow(ranker: Ranker, names: Mapping[str, str]) -> Hypothesis:
    """Terms chosen one after the other; each must add enough evidence."""
    least, most = by_chance(len(names)), UnexplainedSettings.current().terms
    chosen: Hypothesis = ()
    reached = ranker.score(chosen).log_evidence
    for _ in range(most):
        table = {n: ranker.score((*chosen, n)).log_evidence for n in names if n not in chosen}
        if not table:
            break
        name = max(table, key=table.__getitem__)
        if table[name] < reached + least:
            break
        chosen, reached = (*chosen, name), table[name]
    return chosen


def _formula(ranker: Ranker, names: Mapping[str, str], chosen: Hypothesis) -> Formula:
    """The formula of these candidates, fitted."""
    score = ranker.score(chosen)
    at = [ranker.lead[n] for n in chosen]
    values = tuple((float(score.z[i]), float(np.sqrt(score.covariance[i, i]))) for i in at)
    gain = score.log_evidence - ranker.score(()).log_evidence
    return Formula(chosen, tuple(names[n] for n in chosen), values, gain)
