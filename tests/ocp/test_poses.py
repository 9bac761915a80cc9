"""Where poses are sought, and what one that misses a requirement reaches instead."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from kemba.ocp import load_task
from kemba.ocp.infeasibility.pose import Poses
from kemba.ocp.reading import asked_of


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


def test_a_pose_is_sought_where_the_body_is_asked_to_be() -> None:
    """Behind a hurdle, which stands between there and x = 0."""
    model, requirements = asked_of(*load_task("hurdle.yaml"))
    here = [r for r in requirements if r.holds(1.0) and r.minus is None]
    first = Poses(model, requirements)._solve(here, set(), 0)
    assert first is not None and np.abs(first[1]).max() < 1e-6
