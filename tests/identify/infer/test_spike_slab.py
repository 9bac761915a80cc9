"""Scores of many hypotheses from one factor are those of each hypothesis alone."""

import numpy as np
import pytest

from kemba.identify.infer.linear import Linear, Ranker
from kemba.identify.problem.problem import Candidate, Parameter


def ranker() -> Ranker:
    """A random problem of 14 nuisance parameters and 8 effects, away from the prior mean."""
    rng = np.random.default_rng(0)
    n, k, effects = 300, 22, 8
    names = (*(f"figure{i}" for i in range(k - effects)), *(f"e{i}.a" for i in range(effects)))
    J = rng.standard_normal((n, k)) * rng.uniform(0.01, 30, k)
    r = rng.standard_normal(n) + 0.5 * J[:, -3]
    at, width = np.where(np.arange(k) < k - 4, 0.0, 0.3), rng.uniform(0.1, 3.0, k)
    sums = ((J.T @ J)[None], (J.T @ r)[None], np.array([r @ r]), np.array([n]))
    linear = Linear(names, at, np.zeros(k), width, *sums)
    candidates = {
        f"e{i}": Candidate(
            f"e{i}", Parameter("a", "N", 0.0, width[k - effects + i], 0.0 if i % 2 else -np.inf)
        )
        for i in range(effects)
    }
    return Ranker(linear, candidates, names[: k - effects])


@pytest.mark.parametrize("given", [(), ("e2", "e5")])
def test_the_table_is_that_of_single_scores(given: tuple[str, ...]) -> None:
    scores = ranker()
    table = scores.table(given)
    assert len(table) == 8 - len(given) and all(set(given) < set(h) for h in table)
    for hypothesis, evidence in table.items():
        assert evidence == pytest.approx(scores.score(hypothesis).log_evidence, abs=1e-8)
