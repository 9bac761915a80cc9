"""Level ground whose height changes while the whole robot flies.

Dynamics know heights only by contacts and gravity. So a jump onto a platform is one on level ground
whose heights count, from some node of the flight on, from the ground that comes next: there the
kinematics of the body's height lose what the ground rises.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

SAME = 1e-9  # share of a motion; moments that are nearer are one


@dataclass(frozen=True)
class GroundRise:
    """From a `share` of the nodes on the ground is `height` [m] higher than before; the share is a
    node of every grid."""

    share: float
    height: float


def ground_after(rises: Sequence[GroundRise], share: float) -> float:
    """Height of the ground beyond that at the start [m], at a share of the nodes."""
    return sum(rise.height for rise in rises if rise.share <= share + SAME)


def ground_at_nodes(rises: Sequence[GroundRise], nodes: int) -> np.ndarray:
    """The same at every node (nodes + 1,)."""
    return np.array([ground_after(rises, k / nodes) for k in range(nodes + 1)])
