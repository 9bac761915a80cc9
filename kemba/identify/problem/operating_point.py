"""Where each residual row was taken: region of the stroke, and the push of the air on the rod."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from kemba.effects.pneumatics.constants import ATMOSPHERE
from kemba.identify.problem.types import Array
from kemba.mechanism import Cylinder


def air_force(states: Mapping[str, Array], cylinder: Cylinder, prefix: str = "") -> Array:
    """Push of the air on a rod [N] from the chambers' states by name, in force or in pressure."""
    push = []
    areas = {"extend": cylinder.area_extend, "retract": cylinder.area_retract}
    for chamber, area in areas.items():
        name = f"{prefix}chamber/{chamber}/"
        known = states.get(f"{name}F")
        push.append((states[f"{name}P"] - ATMOSPHERE) * area if known is None else known)
    return np.asarray(push[0] - push[1])
