"""Simple terms of a force, judged by the same evidence as the effects of the catalogue."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from kemba.identify.infer.linear import NULL, Hypothesis, Ranker, condense
from kemba.identify.infer.search import Search
from kemba.identify.infer.significance import RARE, bootstrap, redrawn_noise
from kemba.identify.problem.noise import drift_waves
from kemba.identify.problem.problem import Array, Candidate, Parameter, Problem


def drift_columns(problem: Problem) -> tuple[Array, Array]:
    """Columns (n, d) of slow drifts of every channel in every run, whitened, and the prior width
    (d,) of each. None where the motion depends on the model: there drifts are noise of a filter.
    """
    rows, columns, widths = problem.rows(), [], []
    if problem.moves:
        return np.empty((len(rows), 0)), np.empty(0)
    for run, channel in np.unique(np.stack([rows.run, rows.channel]), axis=1).T:
        own = (rows.run == run) & (rows.channel == channel)
        waves, sigmas = drift_waves(rows.time[own])
        columns.append(np.zeros((len(rows), len(sigmas))))
        columns[-1][own] = waves
        widths.append(sigmas)
    return problem.whiten(np.hstack(columns)), np.concatenate(widths)


WIDTH = 10.0  # prior of a term's force, in sigmas of the noise where it acts most
TERMS = 2  # most terms of a formula: a formula can be read
MATTERS = 0.2  # smallest force of a term, as a share of what matters in practice
NO_FORCE = 1e-9  # force, in sigmas, of a term that acts nowhere: zero


@dataclass(frozen=True)
class Formula:
    """A force as a sum of simple terms.

    `candidates`: names of the `terms` in their ranker; `coefficients`: value and sigma of each
    term; `gain` [nats]: log evidence that they add to the best effects; `p_value`: share of logs in
    which nothing is missing whose best term looks as good.
    """

    candidates: Hypothesis
    terms: tuple[str, ...]
    coefficients: tuple[tuple[float, float], ...]
    gain: float
    p_value: float = 1.0

    def __str__(self) -> str:
        return "F = " + " + ".join(
            f"({c:.4g} +- {1.96 * s:.2g})*({t})"
            for t, (c, s) in zip(self.terms, self.coefficients, strict=True)
        )


def extended(search: Search, formulas: Mapping[str, Array]) -> tuple[Ranker, Array, dict[str, str]]:
    """A ranker with these `formulas`, columns (n,), as further candidates, its slopes (n, k), and
    name of a candidate -> formula.

    Beside them every sensor may drift: a formula is what no drift explains.
    """
    mode = search.points[NULL].mode
    names = {f"term{i}": formula for i, formula in enumerate(formulas)}
    columns = np.stack([formulas[f] for f in names.values()], axis=1)
    reach = np.percentile(np.abs(columns), 99, axis=0)
    widths = WIDTH / np.maximum(reach, NO_FORCE)
    keep = [i for i in range(len(names)) if reach[i] > NO_FORCE]
    names = {n: f for i, (n, f) in enumerate(names.items()) if i in keep}
    columns, widths = columns[:, keep], widths[keep]
    candidates = {
        n: Candidate(n, Parameter("c", size=float(w))) for n, w in zip(names, widths, strict=True)
    }
    linear = mode.linear
    drifts, sigmas = drift_columns(search.problem)
    zeros = np.zeros(len(widths) + len(sigmas))
    keys = [*(c.key for c in candidates.values()), *(f"drift{i}" for i in range(len(sigmas)))]
    jacobian = np.concatenate([search.base.jacobian, columns, drifts], axis=1)
    joined = condense(
        (*linear.names, *keys),
        np.concatenate([linear.at, zeros]),
        np.concatenate([linear.mean, zeros]),
        np.concatenate([linear.width, widths, sigmas]),
        jacobian,
        mode.residual,
        search.base.blocks,
    )
    problem = search.problem
    known = {**problem.candidates, **candidates}
    return Ranker(joined, known, problem.nuisance, silent=candidates), jacobian, names


def by_chance(count: int) -> float:
    """Gain [nats] that the best of `count` terms rarely reaches by chance.

    A Bayes factor exceeds exp(g) with a probability of exp(-g) at most where its term is not there
    (Markov's inequality); `count` of them do so with `count` times that probability at most.
    """
    return float(np.log(count / RARE))


def look(search: Search, best: Hypothesis) -> Formula | None:
    """The formula that explains what the best catalogue answer cannot, if there is one.

    Its evidence is more than chance gives in any logs, and in simulated ones with the noise of
    these: where that is slower than it is taken to be, terms gain tens of nats by it.
    """
    null = search.points[NULL]
    formulas = search.problem.formulas(null.fit.theta)
    if not formulas:
        return None
    ranker, jacobian, names = extended(search, formulas)
    alone = _formula(ranker, names, _grow(ranker, names))
    parts = zip(alone.candidates, alone.terms, alone.coefficients, strict=True)
    weight = {t: search.problem.weight(null.fit.theta, t) for t in alone.terms}
    chosen = tuple(n for n, term, (c, _) in parts if abs(c) * weight[term] > MATTERS)
    alone = _formula(ranker, names, chosen)  # without the imperfection that every model has
    catalogue = search.points[best].log_evidence - null.log_evidence
    if not chosen or alone.gain <= catalogue + by_chance(len(names)):
        return None
    noise = redrawn_noise(search, ranker.linear, jacobian)
    test = bootstrap(ranker, noise, list(names))
    if alone.gain <= catalogue + test.threshold:
        return None
    return replace(alone, gain=alone.gain - catalogue, p_value=test.p_value(alone.gain))


def _grow(ranker: Ranker, names: Mapping[str, str]) -> Hypothesis:
    """Terms chosen one after the other; each must add enough evidence."""
    least, most = by_chance(len(names)), TERMS
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
