"""What is kept: a half robot's plan only where the whole one agrees, the better of two iterates."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from ocp.test_program import guess, program
from ocp.toys import Push, bead, solve

from kemba.ocp.nlp.ipopt import Ipopt, Iterate, Parameters
from kemba.ocp.relaxation.lifting import confirm
from kemba.ocp.relaxation.schedule import Schedule
from kemba.ocp.transcription.transcribe import Transcription


def test_a_plan_that_falls_short_on_the_whole_robot_is_solved_there() -> None:
    """A start guess is no plan of the whole robot, whatever is said of it on the half one."""
    half, whole = program(True), Ipopt(program(False), {"max_iter": 1})
    search = Schedule(whole, 1e-6)
    confirm(search, half, Iterate(guess(half), message="Solve_Succeeded"))
    (attempt,) = search.attempts
    assert (attempt.name, attempt.iterations) == ("whole robot", 1)


@cache
def metre() -> tuple[Transcription, np.ndarray]:
    """A bead pushed for a metre from rest to rest: the program, and a point that solves it."""
    ends = {"body/x": 1.0, "body/vx": 0.0}
    start = {"body/x": 0.0, "body/vx": 0.0}
    found, point = solve(bead(), [Push()], start, end=ends, duration=2.2, nodes=6)
    return found, point.Y


@pytest.mark.parametrize("group", ["v", "u"], ids=["rows violated", "bounds violated"])
@pytest.mark.parametrize("solved_last", [True, False])
def test_a_stop_keeps_the_less_violated_iterate(group: str, solved_last: bool) -> None:
    """10 m/s off is within the bounds but breaks the rows; 10 N is beyond what may push."""
    found, good = metre()
    bad = good.copy()
    bad[3, found.layout.slices[group]] += 10.0
    start, point = (bad, good) if solved_last else (good, bad)
    search, stopped = Schedule(Ipopt(found), 1e-6), Iterate(point, message="User_Requested_Stop")
    kept = search.better(Iterate(start), stopped, Parameters(0.0))
    assert np.array_equal(kept.Y, good)
    assert kept.message == "User_Requested_Stop"
