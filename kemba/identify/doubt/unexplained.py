"""What no effect of the catalogue explains: simple terms, judged by the same evidence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from kemba.identify.evidence.linear import Linear, condense
from kemba.identify.evidence.problem import Array, Candidate, Labels, Parameter
from kemba.identify.evidence.search import Search
from kemba.identify.evidence.spike_slab import NULL, Hypothesis, Ranker

WIDTH = 10.0  # prior of a term: so many sigma where it acts most
AHEAD = 6.0  # nats by which a formula must beat the catalogue
STRUCTURE = 1.0  # repeatable mean square, in noise units, that an imperfect model may leave,
LEFT = 0.1  # and as a share of what the answer explains
MATTERS = 0.2  # a formula whose force stays below this share of an effect's size is no finding
CLIP, RIDGES, FOLDS = 30.0, (1e-4, 1e-2, 1.0), 5


def structured(search: Search, hypothesis: Hypothesis) -> tuple[float, float]:
    """Mean square of the residual in noise units, and the part of it that repeats itself.

    A regression on everything a force could depend on is learnt on some blocks and judged on the
    others: what it predicts there is structure, and no noise, however coloured.
    """
    left_over = search.problem.leftover(search.points[hypothesis].fit.theta)
    if left_over is None:
        return 1.0, 0.0
    r, columns = np.clip(left_over.residual, -CLIP, CLIP), left_over.features
    columns = columns / np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-9)
    folds = _folds(left_over.run)
    power = float(np.mean(r**2))
    left = min(float(np.mean((r - _foretold(r, columns, folds, k)) ** 2)) for k in RIDGES)
    return power, max(power - left, 0.0)


def _foretold(r: Array, columns: Array, folds: Labels, ridge: float) -> Array:
    """Each fold as the regression on the others foretells it."""
    predicted = np.zeros(len(r))
    for fold in np.unique(folds):
        out = folds == fold
        a, b = columns[~out], r[~out]
        h = a.T @ a + ridge * len(a) * np.eye(a.shape[1])
        predicted[out] = columns[out] @ np.linalg.solve(h, a.T @ b)
    return predicted


def _folds(run: Labels) -> Labels:
    """Blocks of time, FOLDS of them per run, dealt out in turn."""
    labels = np.zeros(len(run), dtype=int)
    for i in np.unique(run):
        own = np.flatnonzero(run == i)
        labels[own] = np.arange(len(own)) * 2 * FOLDS // len(own) % FOLDS
    return labels


def unfinished(search: Search, best: Hypothesis) -> bool:
    """Whether so much structure is left that the answer cannot be the whole of it."""
    power, structure = structured(search, best)
    if not best:
        return structure > STRUCTURE
    before, _ = structured(search, NULL)
    return structure > max(STRUCTURE, LEFT * max(before - power, 0.0))


@dataclass(frozen=True)
class Formula:
    """Terms found, coefficients (value, sigma), and how much evidence they add [nats]."""

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
    """A ranker that knows these terms as further candidates; their names by formula."""
    names = {f"term{i}": formula for i, formula in enumerate(formulas)}
    columns = np.stack([formulas[f] for f in names.values()], axis=1)
    reach = np.percentile(np.abs(columns), 99, axis=0)
    widths = WIDTH / np.maximum(reach, 1e-9)
    keep = [i for i in range(len(names)) if reach[i] > 1e-9]
    names = {n: f for i, (n, f) in enumerate(names.items()) if i in keep}
    columns, widths = columns[:, keep], widths[keep]
    candidates = {
        n: Candidate(n, Parameter("c", size=float(w))) for n, w in zip(names, widths, strict=True)
    }
    zeros = np.zeros(len(widths))
    joined = condense(
        (*linear.names, *(c.key for c in candidates.values())),
        np.concatenate([linear.at, zeros]),
        np.concatenate([linear.mean, zeros]),
        np.concatenate([linear.width, widths]),
        np.concatenate([jacobian, columns], axis=1),
        r,
        search.base.division.blocks,
    )
    problem = search.problem
    ranker = Ranker(joined, {**problem.candidates, **candidates}, problem.nuisance)
    ranker.silent = frozenset(candidates)
    return ranker, names


def look(search: Search, best: Hypothesis) -> Formula | None:
    """The formula that explains what the best catalogue answer cannot, if there is one."""
    null = search.points[NULL]
    formulas = search.problem.formulas(null.fit.theta)
    if not formulas:
        return None
    ranker, names = extended(
        search, null.linear, search.base.jacobian, search.base.residual, formulas
    )
    alone = _grow(ranker, names, ())
    catalogue = search.points[best].log_evidence - null.log_evidence
    if alone is not None and alone.gain > catalogue + AHEAD and _matters(search, alone):
        return replace(alone, gain=alone.gain - catalogue)
    return None


def _matters(search: Search, formula: Formula) -> bool:
    """Whether a formula is more than the imperfection that every model has."""
    problem, theta = search.problem, search.points[NULL].fit.theta
    parts = zip(formula.terms, formula.coefficients, strict=True)
    return any(problem.weight(theta, term, c) > MATTERS for term, (c, _) in parts)


def _grow(ranker: Ranker, names: Mapping[str, str], start: Hypothesis) -> Formula | None:
    """Greedy choice of at most two terms; each must bring its share."""
    base = ranker.score(start).log_evidence
    chosen, reached = start, base
    for _ in range(2):
        table = {n: ranker.score((*chosen, n)).log_evidence for n in names if n not in chosen}
        if not table:
            break
        name = max(table, key=table.__getitem__)
        if table[name] < reached + AHEAD + 2.0:
            break
        chosen, reached = (*chosen, name), table[name]
    terms = tuple(n for n in chosen if n not in start)
    if not terms:
        return None
    score = ranker.score(chosen)
    at = [ranker.lead[n] for n in terms]
    values = tuple((float(score.z[i]), float(np.sqrt(score.covariance[i, i]))) for i in at)
    return Formula(tuple(names[n] for n in terms), values, reached - base)
