"""Does a parameter differ from run to run? Then something is missing that changes with the run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kemba.identify.doubt.cross_validation import within_tolerance
from kemba.identify.evidence.search import Search
from kemba.identify.evidence.spike_slab import NULL, Hypothesis, SpikeSlabSettings
from kemba.identify.problem.problem import Array, Labels


class RunConsistencySettings:
    """When a parameter differs from run to run."""

    clear = 100.0  # gain of a value per run over one value for all that is asked for [nats]
    share_of_rows = 0.01  # the same per row of the logs [nats]
    share = 0.1  # the same as a share of the gain of the answer itself
    spread = 1.2  # sizes between the smallest and the largest value
    forgiven = 0.15  # error of a run, in sigmas of one row, that all its rows may share
    informed = 0.2  # a run is asked where it gives the parameter with this sigma, in sizes


@dataclass(frozen=True)
class Drift:
    """A parameter whose values per run contradict each other.

    `values`: one per run that tells the parameter [its unit]; `nats`: gain of these over one value.
    """

    effect: str
    key: str
    values: tuple[float, ...]
    nats: float

    def __str__(self) -> str:
        listed = ", ".join(f"{v:.3g}" for v in self.values)
        return f"{self.key} differs from run to run: {listed}"


def drifting(search: Search, best: Hypothesis) -> Drift | None:
    """The clearest case of a parameter that differs, in the error that the best answer leaves."""
    settings, spike = RunConsistencySettings, SpikeSlabSettings.spike
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
        error = (1.0 + settings.forgiven**2 * count) / np.maximum(gram, 1e-12)
        keep = error < (settings.informed * candidate.lead.size) ** 2
        if keep.sum() < 2:
            continue
        gram, slope = gram[keep], slope[keep]
        narrow = error[keep] + (spike * candidate.lead.size) ** 2
        own = -slope / gram
        shared = float(np.sum(own / narrow) / np.sum(1.0 / narrow))
        nats = 0.5 * float(np.sum((own - shared) ** 2 / narrow))
        if np.ptp(own) > settings.spread * candidate.lead.size:
            values = tuple(float(candidate.lead.off + a) for a in own)
            found.append(Drift(effect, candidate.key, values, nats))
    clearest = max(found, key=lambda d: d.nats, default=None)
    least = max(settings.clear, settings.share * gained, settings.share_of_rows * len(residual))
    if clearest is None or clearest.nats < least:
        return None
    return clearest


def _tolerant(search: Search) -> Array:
    """Residual of the model as it is, its nominal figures within their tolerance."""
    linear = search.points[NULL].linear
    z = within_tolerance(search, linear, NULL)
    return search.base.residual + search.base.jacobian @ (z - linear.at)


def _sums(values: Array, run: Labels) -> Array:
    """Sum (runs,) of values (n,) over the rows of each run."""
    return np.asarray(np.bincount(run, weights=values), dtype=float)
