"""How much of an error the model's figures could explain if they were off by their tolerance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kemba.identify.evidence.spike_slab import SpikeSlabSettings
from kemba.identify.problem.problem import Array, Candidate, Problem, Theta
from kemba.identify.tails import false_discoveries, normal_above


@dataclass(frozen=True)
class Slopes:
    """Slopes of a residual.

    `by_lead` (n, leads): along the switch of every effect, per size. `by_nuisance` (n, nuisance):
    along every nuisance parameter, per prior sigma.
    """

    leads: tuple[Candidate, ...]
    by_lead: Array
    by_nuisance: Array


def slopes(problem: Problem, at: Theta) -> Slopes:
    """Slopes at theta `at`, of all effects but sensor faults."""
    leads = tuple(c for c in problem.candidates.values() if not c.sensor)
    nuisance = list(problem.nuisance)
    jacobian = problem.jacobian(at, [*(c.key for c in leads), *nuisance])
    jacobian = jacobian * (
        [c.lead.size for c in leads] + [problem.nuisance[n][1] for n in nuisance]
    )
    return Slopes(leads, jacobian[:, : len(leads)], jacobian[:, len(leads) :])


@dataclass(frozen=True)
class Tolerant:
    """What is left when the model is as good as models are.

    `left` (n,): the residual. `q_value`: of the figure or absent effect that is farthest off; it
    controls false discoveries over all of them.
    """

    left: Array
    q_value: float


def within_tolerance(residual: Array, known: Slopes) -> Tolerant:
    """The likeliest explanation of a residual (n,) by a model that lacks nothing.

    Each nuisance parameter is off by about its prior sigma, and each absent effect is there with a
    small share of its size, as under every hypothesis of `discover`. The likeliest values, in units
    of these sigmas, are then no larger than standard normal numbers are.
    """
    spike = SpikeSlabSettings.spike
    columns = np.hstack([spike * known.by_lead, known.by_nuisance])
    h = columns.T @ columns + np.eye(columns.shape[1])
    off = -np.linalg.solve(h, columns.T @ residual)
    q = false_discoveries(2.0 * normal_above(np.abs(off))) if len(off) else np.ones(1)
    return Tolerant(residual + columns @ off, float(q.min()))
