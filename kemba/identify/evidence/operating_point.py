"""Where each residual row was taken: region of the stroke, and the push of the air on the rod."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from kemba.effects.pneumatics.constants import AREA_E, AREA_R, ATMOSPHERE
from kemba.identify.evidence.types import Array


def air_force(states: Mapping[str, Array], prefix: str = "") -> Array:
    """Push of the air on a rod [N] from the chambers' states by name, in force or in pressure."""
    push = []
    for chamber, area in (("extend", AREA_E), ("retract", AREA_R)):
        name = f"{prefix}chamber/{chamber}/"
        known = states.get(f"{name}F")
        push.append((states[f"{name}P"] - ATMOSPHERE) * area if known is None else known)
    return np.asarray(push[0] - push[1])
