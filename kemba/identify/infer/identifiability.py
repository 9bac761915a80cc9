"""What logs can tell before any effect is looked for: which would show, and which look alike.

With slopes of the residual by all effects at the model as it is, the information about two effects
is the inverse of their posterior covariance less what their prior tells; all others are free within
theirs. If A is there at its usual size s and B is fitted in its place, the expected evidence
against B is half of s^2 times the information about A that is left when B is free.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import connected_components

from kemba.errors import enumerated
from kemba.identify.infer.spike_slab import NULL, Ranker, SpikeSlabSettings
from kemba.identify.problem.types import Array

CLEAR = 5.0  # nats that tell two effects apart: Kass and Raftery 1995, 'very strong' evidence


@dataclass(frozen=True)
class Identifiability:
    """What logs can tell of the effects of a catalogue.

    `sizes`: effect -> the smallest size [unit of its switch] that shows nine times in ten, None
    where none does. `shown`: those that show at their usual size. `alike`: groups of these, each of
    which has too little evidence against another one."""

    sizes: Mapping[str, float | None]
    shown: Sequence[str]
    alike: Sequence[Sequence[str]]

    @property
    def sentence(self) -> str:
        """The whole in one sentence."""
        told = f"these logs would show {len(self.shown)} of {len(self.sizes)} effects at usual size"
        groups = "; ".join(enumerated(group) for group in self.alike)
        return f"{told}, and cannot tell apart {groups}" if groups else told


def identifiability(ranker: Ranker, sizes: Mapping[str, float | None]) -> Identifiability:
    """What the slopes of a ranker tell; `sizes`: the smallest that show, by effect."""
    usual = {e: ranker.candidates[e].lead.size for e in sizes}
    shown = [e for e, size in sizes.items() if size is not None and size <= usual[e]]
    count, labels = connected_components(expected(ranker, shown) < CLEAR, directed=False)
    groups = ([e for e, k in zip(shown, labels, strict=True) if k == own] for own in range(count))
    return Identifiability(sizes, shown, [group for group in groups if len(group) > 1])


def expected(ranker: Ranker, effects: Sequence[str]) -> Array:
    """Expected evidence (e, e) [nats] between every two of the effects, the lesser of the two
    directions; infinite on the diagonal."""
    prior, at = SpikeSlabSettings, [ranker.lead[e] for e in effects]
    size = np.array([ranker.candidates[e].lead.size for e in effects])
    shared = ranker.score(NULL).covariance[np.ix_(at, at)]
    own, itself = np.diag(shared), np.eye(len(at))
    determinant = np.outer(own, own) - shared**2 + itself
    told = own / determinant - (prior.spike * size[:, None]) ** -2.0  # of the row's effect
    left = told - (shared / determinant) ** 2 / (told.T + (prior.slab * size) ** -2.0)
    nats = np.where(itself, np.inf, 0.5 * size[:, None] ** 2 * left)
    return np.asarray(np.fmin(nats, nats.T))
