"""Repeated executions in words."""

from pathlib import Path

import numpy as np

from kemba.plant.controller import Execution
from kemba.plant.repeat import Repeat, outcome
from kemba.plant.replay import EndError, Replay
from kemba.plant.simulate import Simulated
from kemba.trajectory import Trajectory


def execution(apex: float, end: EndError | None, fault: str | None = None) -> Repeat:
    rows = {"body/z [m]": [0.3, apex], "body/x [m]": [0.0, 0.45], "body/vx [m.s-1]": [0.0, 1.6]}
    motion = Trajectory(np.array([0.0, 0.5]), {name: np.array(at) for name, at in rows.items()})
    replay = Replay(apex - 0.393, None, 0.0, fault, motion, (), end=end)
    return Repeat(Path("log.csv"), Execution(Simulated(motion, ()), motion), replay)


def test_all_that_is_reached_is_told_and_what_is_alike_once() -> None:
    """How far and how fast, too, and how far these are off where a plan ends in motion."""
    end = EndError(0.1, -0.13, 1.7)
    several = [execution(0.385, end), execution(0.385, end), execution(0.39, None, "tips over")]
    assert outcome(several, "plant") == (
        "reached 0.385 m, 0.45 m ahead, 1.60 m/s at the end; 0.390 m, 0.45 m ahead, 1.60 m/s at "
        "the end on plant, off the plan by at most 8 mm at the apex and 0.13 m/s at the end; 2 of "
        "3 stayed upright"
    )
