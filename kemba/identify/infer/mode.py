"""A hypothesis where it fits best: what it does not name may be there a little.

Slopes of effects are secants: of a delay over a row, of others over their size. A twentieth of the
size does something else, as where an edge falls between two readings. A refit, which has the
residual at its own values, would gain from this difference alone, and an effect would look missing
on a machine that has a little of many. So every hypothesis is judged by the residual at its mode.
"""

from collections.abc import Collection, Iterable
from dataclasses import dataclass

import numpy as np

from kemba.errors import KembaError
from kemba.identify.infer.linear import Linear, estimate, moved, priors, usual_shapes
from kemba.identify.infer.spike_slab import Hypothesis, Ranker
from kemba.identify.problem.problem import Array, Labels, Problem, Theta

# How the mode of a hypothesis is found, every other effect being small.
ROUNDS = 5  # linear steps, each with the residual where it led
CHANGE = 0.1  # change of the evidence at which the last step is done [nats]
ABSURD = 1e5  # residual in sigmas at which nothing can be predicted: beyond data


@dataclass(frozen=True)
class Mode:
    """A problem linearised where a hypothesis fits best: `linear` about `theta`, with the
    `residual` (n,) there; `cost` of that point with its priors, half a sum of squares."""

    theta: dict[str, float]
    linear: Linear
    residual: Array
    cost: float


def mode_of(
    problem: Problem,
    hypothesis: Hypothesis,
    starts: Iterable[Theta],
    linear: Linear,
    jacobian: Array,
    blocks: Labels,
) -> Mode:
    """The mode of a hypothesis, by linear steps from the best of `starts`.

    `linear` and its `jacobian` (n, k): slopes that hold there; `blocks` (n,) label the rows. Where
    the motion depends on the model, the residual is as straight as its slopes: the start is kept.
    """
    slopes = linear, jacobian, blocks
    tried = [_at(problem, hypothesis, theta, problem.residual(theta), slopes) for theta in starts]
    best = at = min(tried, key=lambda mode: mode.cost)
    reached = _ranker(problem, at.linear).score(hypothesis).log_evidence
    for _ in range(0 if problem.moves else ROUNDS):
        theta = _possible(problem, hypothesis, at.linear)
        try:
            r = problem.residual(theta)
        except KembaError:
            break  # a linear estimate may point to where nothing can be simulated
        if not np.all(np.abs(r) < ABSURD):
            break
        at = _at(problem, hypothesis, theta, r, slopes)
        best = at if at.cost < best.cost else best
        before, reached = reached, _ranker(problem, at.linear).score(hypothesis).log_evidence
        if abs(reached - before) < CHANGE:
            break
    return best


def _at(
    problem: Problem,
    hypothesis: Hypothesis,
    theta: Theta,
    r: Array,
    slopes: tuple[Linear, Array, Labels],
) -> Mode:
    """The problem about theta, where the residual is r (n,)."""
    linear, jacobian, blocks = slopes
    z, mean, _ = priors(problem, theta, linear.names)
    pull = (z - mean) / _ranker(problem, linear).widths(hypothesis, 1.0)
    cost = 0.5 * float(r @ r + pull @ pull)
    return Mode(dict(theta), moved(linear, z, jacobian, r, blocks), r, cost)


def _ranker(problem: Problem, linear: Linear, absent: Collection[str] = ()) -> Ranker:
    return Ranker(linear, problem.candidates, problem.nuisance, silent=absent)


def _possible(problem: Problem, hypothesis: Hypothesis, linear: Linear) -> dict[str, float]:
    """Theta of the best fit in which what would be on an impossible side is absent."""
    absent: set[str] = set()
    free = {n: c for n, c in problem.candidates.items() if n not in hypothesis}
    while True:
        z = _ranker(problem, linear, absent).score(hypothesis).z
        theta = estimate(problem, linear, z)
        wrong = free.keys() & problem.structures
        wrong |= {n for n, c in free.items()
                  if not c.lead.signed and theta.get(c.key, c.lead.off) <= c.lead.off}  # fmt: skip
        if wrong <= absent:
            break
        absent |= wrong
    found = {k: v for k, v in theta.items() if k not in {free[n].key for n in absent}}
    return usual_shapes(free, found) | found
