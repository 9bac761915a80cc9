"""What bench logs can say of effects beyond the catalogue: formulas, and what is left over."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from kemba.identify.bench.bench_log import FRICTION
from kemba.identify.bench.formulas import features, terms
from kemba.identify.evidence.linear import within
from kemba.identify.evidence.problem import Array, Theta
from kemba.identify.evidence.spike_slab import SPIKE_WIDTH

if TYPE_CHECKING:
    from kemba.identify.bench.problem import BenchProblem

PEAK = 99.5  # per cent of the rows below which a force counts as its largest


def formula_columns(problem: BenchProblem, theta: Theta) -> dict[str, Array]:
    """Columns (n,) by formula, per unit of its coefficient."""
    parts: dict[str, list[Array]] = {}
    for i, run in enumerate(problem.logs):
        predicted = problem.predict(theta, i)
        found = _terms(problem, theta, i)
        for channel, (_, variance) in predicted.items():
            keep = run.keep[channel]
            for formula, force in found.items():
                column = force if channel == "piston/F" else np.zeros(len(force))
                parts.setdefault(formula, []).append((column / np.sqrt(variance))[keep])
    columns = np.stack([np.concatenate(p) for p in parts.values()], axis=1)
    return dict(zip(parts, problem.whiten(columns).T, strict=True))


def weight(problem: BenchProblem, theta: Theta, formula: str, coefficient: float) -> float:
    """Largest force of a formula as a share of what matters in practice."""
    forces = (_terms(problem, theta, i)[formula] for i in range(len(problem.logs)))
    peak = max(float(np.percentile(np.abs(force), PEAK)) for force in forces)
    return abs(coefficient) * peak / FRICTION


def leftover(problem: BenchProblem, theta: Theta) -> tuple[Array, Array, Array]:
    """Force residual over its noise and over what every model leaves (n,), what it may depend
    on (n, m), and run (n,)."""
    parts = []
    for i, run in enumerate(problem.logs):
        keep = run.keep["piston/F"]
        r = problem.standardised(theta, i)["piston/F"] / _imperfection(problem, i)
        u = problem.predictor.acting(run, theta)
        seen = features(problem.predictor.true_motion(run, theta), u)[keep]
        parts.append((r, seen, np.full(len(r), i)))
    residual, columns, index = (np.concatenate(p) for p in zip(*parts, strict=True))
    return residual, columns, index


def _terms(problem: BenchProblem, theta: Theta, index: int) -> dict[str, Array]:
    run = problem.logs[index]
    predictor = problem.predictor
    return dict(terms(predictor.true_motion(run, theta), predictor.acting(run, theta)))


def _imperfection(problem: BenchProblem, index: int) -> Array:
    """Spread (n,) of the force residual, in noise units, when every effect of the catalogue may
    be there at floor level."""
    base = problem.standardised({}, index)["piston/F"]
    power = np.ones(len(base))
    for c in problem.candidates.values():
        small = {c.key: c.lead.off + SPIKE_WIDTH * c.lead.size}
        there = problem.standardised(within(problem, small), index)["piston/F"]
        power += (there - base) ** 2
    return np.asarray(np.sqrt(power))
