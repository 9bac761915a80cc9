"""What a pose that misses a requirement reaches instead."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from kemba.ocp.infeasibility.pose import Poses


def asked(name: str, lower: float, upper: float) -> Any:
    return SimpleNamespace(quantity=SimpleNamespace(name=name), lower=lower, upper=upper)


def test_a_gap_is_of_the_bound_that_is_missed() -> None:
    """Above the upper one, below the lower one; what is met is not told."""
    high, low = asked("body/z", -np.inf, 0.4), asked("body/z", 0.3, np.inf)
    poses: Any = SimpleNamespace(names=["body/z", "body/pitch"])
    for slack, requirement, bound in ((0.05, high, 0.4), (-0.05, low, 0.3)):
        (gap,) = Poses._told(poses, np.array([slack, 1e-9]), [high, low])
        assert gap.requirement is requirement
        assert (gap.asked, gap.reachable) == (bound, bound + slack)
