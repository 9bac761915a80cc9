"""What bench logs can say of effects beyond the catalogue: formulas, and what is left over."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from kemba.identify.bench.formulas import features, terms
from kemba.identify.bench.predicted import PredictedLogs
from kemba.identify.evidence.linear import within
from kemba.identify.evidence.spike_slab import SpikeSlabSettings
from kemba.identify.problem.types import Array, Candidate, Leftover, Theta


def formula_columns(predicted: PredictedLogs, theta: Theta) -> tuple[tuple[str, ...], Array]:
    """Formulas, and their columns (n, k) of the residual, not whitened, per unit of coefficient."""
    parts: dict[str, list[Array]] = {}
    for i, log in enumerate(predicted.logs):
        forces = _forces(predicted, theta, i)
        for channel, (_, variance) in predicted.readings(theta, i).items():
            keep = log.keep[channel]
            for formula, force in forces.items():
                column = force if channel == "piston/F" else np.zeros(len(force))
                parts.setdefault(formula, []).append((column / np.sqrt(variance))[keep])
    return tuple(parts), np.stack([np.concatenate(p) for p in parts.values()], axis=1)


def leftover(
    predicted: PredictedLogs, theta: Theta, candidates: Mapping[str, Candidate]
) -> Leftover:
    """Force residual over its noise and over what every model leaves, and what it may depend on."""
    parts = []
    for i, log in enumerate(predicted.logs):
        spread = _imperfection(predicted, i, candidates)
        r = predicted.standardised(theta, i)["piston/F"] / spread
        seen = features(predicted.motion(theta, i), predicted.acting(theta, i), predicted.stroke)
        parts.append((r, seen[log.keep["piston/F"]], np.full(len(r), i)))
    residual, columns, run = (np.concatenate(p) for p in zip(*parts, strict=True))
    return Leftover(residual, columns, run)


def _forces(predicted: PredictedLogs, theta: Theta, index: int) -> dict[str, Array]:
    """Formula -> force (n,) per unit of its coefficient along one log."""
    motion, acting = predicted.motion(theta, index), predicted.acting(theta, index)
    return dict(terms(motion, acting, predicted.stroke))


def _imperfection(
    predicted: PredictedLogs, index: int, candidates: Mapping[str, Candidate]
) -> Array:
    """Spread (n,) of the force residual, in noise units, when every effect of the catalogue may
    be there with a small share of its size."""
    base = predicted.standardised({}, index)["piston/F"]
    power, spike = np.ones(len(base)), SpikeSlabSettings.spike
    for c in candidates.values():
        small = within(candidates, {c.key: c.lead.off + spike * c.lead.size})
        power += (predicted.standardised(small, index)["piston/F"] - base) ** 2
    return np.asarray(np.sqrt(power))
