"""Does a parameter wander from run to run? One that does points at the defect, not at its value."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kemba.identify.doubt.cross_validation import within_tolerance
from kemba.identify.evidence.problem import Array, Labels
from kemba.identify.evidence.search import Search
from kemba.identify.evidence.spike_slab import NULL, SPIKE_WIDTH, Hypothesis

CLEAR = 100.0  # nats that separate values per run must bring over one value for all
SHARE_OF_ROWS = 0.01  # per row
SHARE = 0.1  # and as a share of what the answer itself brings
SPREAD = 1.2  # sizes between the smallest and the largest value
FORGIVEN = 0.15  # noise units of force that a run may be off by, whatever the reason
INFORMED = 0.2  # sizes, one sigma of a value that a run must give to be asked


@dataclass(frozen=True)
class Drift:
    """A parameter whose values per run contradict each other."""

    effect: str
    key: str
    values: tuple[float, ...]
    nats: float

    def __str__(self) -> str:
        listed = ", ".join(f"{v:.3g}" for v in self.values)
        return f"{self.key} differs from run to run: {listed}"


def drifting(search: Search, best: Hypothesis) -> Drift | None:
    """The clearest case of a parameter that wanders, in what the best answer leaves over."""
    problem, point = search.problem, search.points[best]
    if len(problem.runs) < 2:
        return None
    run = problem.rows().run
    residual = problem.residual(point.fit.theta) if best else _tolerant(search)
    gained = point.log_evidence - search.points[()].log_evidence
    count = np.bincount(run)
    found: list[Drift] = []
    for effect, candidate in problem.candidates.items():
        column = search.base.jacobian[:, search.points[()].linear.index(candidate.key)]
        gram, slope = _sums(column * column, run), _sums(column * residual, run)
        error = (1.0 + FORGIVEN**2 * count) / np.maximum(gram, 1e-12)
        keep = error < (INFORMED * candidate.lead.size) ** 2
        if keep.sum() < 2:
            continue
        gram, slope = gram[keep], slope[keep]
        narrow = error[keep] + (SPIKE_WIDTH * candidate.lead.size) ** 2
        own = -slope / gram
        shared = float(np.sum(own / narrow) / np.sum(1.0 / narrow))
        nats = 0.5 * float(np.sum((own - shared) ** 2 / narrow))
        if np.ptp(own) > SPREAD * candidate.lead.size:
            values = tuple(float(candidate.lead.off + a) for a in own)
            found.append(Drift(effect, candidate.key, values, nats))
    clearest = max(found, key=lambda d: d.nats, default=None)
    least = max(CLEAR, SHARE * gained, SHARE_OF_ROWS * len(residual))
    if clearest is None or clearest.nats < least:
        return None
    return clearest


def _tolerant(search: Search) -> Array:
    """Residual of the model as it is, its nominal figures within their tolerance."""
    linear = search.points[NULL].linear
    z = within_tolerance(search, linear, NULL)
    return search.base.residual + search.base.jacobian @ (z - linear.at)


def _sums(values: Array, run: Labels) -> Array:
    return np.asarray(np.bincount(run, weights=values), dtype=float)
