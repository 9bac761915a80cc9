"""What may be missing on a rig of the user's own: effects that fit it, sensor faults."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kemba.errors import KembaError
from kemba.identify.problem.candidates import by_default, effect_candidates, sensor_candidates
from kemba.identify.problem.types import Candidate
from kemba.identify.rigs.rig_log import ANSWER, PLACE, RigLog
from kemba.model.model import Model


def possible_candidates(model: Model, logs: Sequence[RigLog]) -> dict[str, Candidate]:
    """Effects and sensor faults by name, sized as the catalogue has them."""
    return standing_candidates(model) | sensor_candidates(_sensor_sigmas(model, logs), model)


def standing_candidates(model: Model) -> dict[str, Candidate]:
    """Effects by name that the model of the rig can have."""
    return {n: c for n, c in effect_candidates(model).items() if stands(model, n)}


def stands(model: Model, kind: str) -> bool:
    """Whether the model can have the effect: some read what is not here, such as valves."""
    try:
        _ = model.with_effects([by_default(kind)]).node
    except KembaError:
        return False
    return True


def _sensor_sigmas(model: Model, logs: Sequence[RigLog]) -> dict[str, float]:
    """Median noise of the channels whose sensors may be wrong. A drive's force is none of them: a
    scale, an offset or a lag of the motor say the same."""
    rig, found = model.mechanism.rig, {}
    for name in model.mechanism.logged:
        if name == ANSWER[rig] == "axis/tau":
            continue
        place, channels = name == PLACE[rig], [log.channels for log in logs]
        sigmas = [c.q_sigma if place else c.sigma[name] for c in channels]
        found[name] = float(np.median(sigmas))
    return found
