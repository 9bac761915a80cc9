"""The order of solves: whole robots grow from half ones, and switches move as often as asked."""

from contextlib import ExitStack
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from kemba.model import load_model
from kemba.ocp import load_task, plan
from kemba.ocp.certificate.status import Status
from kemba.ocp.nlp.ending import Ending, Stagnation
from kemba.ocp.nlp.ipopt import Iterate
from kemba.ocp.planned import Plan
from kemba.ocp.relaxation.guess import body_course
from kemba.ocp.relaxation.schedule import relax_stepwise
from kemba.ocp.relaxation.settings import Ends
from kemba.ocp.task.resolve import resolve

FORWARD = ("nodes=50", "refine=none")
PATIENT = "solver.time_limit=600 s"  # a busy machine must not decide


def told(name: str, *overrides: str) -> tuple[Plan, list[str]]:
    """A plan, and which solves were announced on the way."""
    task, document = load_task(name, list(overrides))
    solves: list[str] = []
    return plan(task, document, tell=solves.append), solves


def test_a_forward_jump_grows_from_half_a_robot() -> None:
    found, solves = told("jump_forward", *FORWARD)
    assert found.status is Status.SOLVED
    assert solves[:3] == [
        f"{step} (half robot, 25 nodes)" for step in ("relax", "binary valves", "round valves")
    ]
    assert all("whole robot" in solve for solve in solves[3:])
    assert "relax (whole robot, 25 nodes)" not in solves
    jump = found.trajectory
    assert jump["body/x"][-1] == pytest.approx(0.3)
    assert abs(jump["front/hip/q"] + jump["rear/hip/q"]).max() > 0.05, "legs move unlike each other"


def test_without_symmetry_it_starts_from_the_guess() -> None:
    _, solves = told("jump_forward", *FORWARD, "solver.symmetry=false", "solver.time_limit=0.5 s")
    assert solves[0] == "relax (whole robot, 25 nodes)"


TOGETHER, APART = "[[rear, front], air, [rear, front]]", "[rear, air, [rear, front]]"


@pytest.mark.parametrize(("contacts", "first"), [(TOGETHER, "half"), (APART, "whole")])
def test_legs_that_stand_together_grow_from_half_a_robot(contacts: str, first: str) -> None:
    _, solves = told("jump_forward", *FORWARD, f"contacts={contacts}", "solver.time_limit=0.5 s")
    assert solves[0] == f"relax ({first} robot, 25 nodes)"


def test_what_does_not_grow_starts_from_the_guess() -> None:
    """A whole robot that gets too few iterations to grow from half a one."""
    task, document = load_task("jump_forward", [*FORWARD, PATIENT])
    whole = [f"{step} (whole robot, 25 nodes)" for step in ("move switches", "relax")]
    solves: list[str] = []
    with ExitStack() as limits:

        def tell(solve: str) -> None:
            solves.append(solve)
            if solve == "round valves (half robot, 25 nodes)":  # just before it grows
                limits.enter_context(patch.object(Ends, "relax_iterations", 2))

        found = plan(task, document, tell=tell, stop=lambda: solves[-1] == whole[-1])
    assert solves[-2:] == whole
    assert found.attempts[-2].ending is Ending.ITERATION_LIMIT


@pytest.mark.parametrize(
    ("limit", "ending"),
    [
        ({"misfit_iterations": 1}, Ending.ITERATION_LIMIT),
        ({"stagnation_iterations": 0}, Ending.GAVE_UP),
    ],
)
def test_valves_that_do_not_fit_the_finer_grid_are_sought_again(
    limit: dict[str, int], ending: Ending
) -> None:
    with patch.multiple(Ends, **limit):
        found, solves = told("jump", "nodes=50", "refine=none")
    assert found.status is Status.SOLVED
    assert ending in [attempt.ending for attempt in found.attempts]
    assert solves.count("relax (half robot, 25 nodes)") == 1  # no other strategy was needed
    assert solves.count("binary valves (half robot, 50 nodes)") == 1


@pytest.mark.parametrize(
    ("violations", "found"),
    [
        ([1.0, 0.9, 0.85, 0.82], True),
        ([1.0, 0.9, 0.75, 0.74, 0.73], False),
        ([1.0, 0.04, 3.0, 2.0, 2.0, 2.0], False),  # it was near before
    ],
)
def test_stagnation_is_found_where_nothing_comes_nearer(
    violations: list[float], found: bool
) -> None:
    stagnation = Stagnation(iterations=3, small=0.05)
    for iteration, violation in enumerate(violations):
        stagnation.hear(iteration, violation)
    assert stagnation.found is found


@pytest.mark.parametrize(
    ("last", "found"), [([1.0] * 50, False), ([8.0] * 4, False), ([8.0] * 6, True)]
)
def test_a_solve_is_given_up_once_long_iterations_have_cost_too_much(
    last: list[float], found: bool
) -> None:
    stagnation = Stagnation(np.inf, 0.05, slow=40.0)
    for clock in np.cumsum([1.0] * 6 + last):
        stagnation.ends.append(float(clock))
    assert stagnation.too_slow() is found


@pytest.mark.parametrize("lift", ["5 cm", "50 cm"])
def test_a_guess_flies_where_feet_must_leave_the_ground(lift: str) -> None:
    """So low that standing would reach it, and nothing else tells of a flight."""
    goals = "apex: {quantity: body/z, at: middle, equals: height}"
    lifted = f"{goals}, flight: {{quantity: '*/foot/z', at: middle, at_least: {lift}}}"
    spans = []
    for asked in (goals, lifted):
        task, document = load_task("hop", ["clearance=0 m", f"goals={{{asked}}}"])
        requirements = resolve(task, load_model(task.model), document)
        course = body_course(requirements, task.duration, (0.17, 0.42), 9.81)
        assert np.all(np.diff(course.t) > 0.0) and np.all(np.isfinite(course(np.array(course.t))))
        spans.append(course.flight[1] - course.flight[0])
    assert spans[0] == 0.0 < 0.1 < spans[1]


@pytest.mark.parametrize(
    ("widest", "shares"),
    [
        (1.0, [0.25, 0.75, 1.0]),  # steps double where they are solved
        (0.4, [0.25, 0.75, 0.5, 1.0, 0.75, 1.0]),  # and halve where they are not
        (0.05, [0.25, 0.125, 0.0625]),
    ],
)
def test_rows_that_are_left_out_at_first_come_in_by_steps(
    widest: float, shares: list[float]
) -> None:
    """From what the first solve leaves, 3 above one bound and 2 below another, to what is asked;
    rows that are met stay free of it, and the program asks for all in the end."""
    asked = np.array([-np.inf, 0.0, 1.0]), np.array([4.0, np.inf, np.inf])
    program: Any = SimpleNamespace(g_lower=asked[0].copy(), g_upper=asked[1].copy(), nodes=2)
    program.problem = SimpleNamespace(g=lambda x, p: [7.0, -2.0, 5.0])
    tried: list[float] = []
    reached = [0.0]

    def solve(name: str, point: Iterate, parameters: Any, options: Any) -> Iterate:
        if np.isinf(program.g_upper[0]):
            return Iterate(point.Y, ending=Ending.SOLVED)
        share = 1.0 - (program.g_upper[0] - 4.0) / 3.0
        assert program.g_lower[1] == pytest.approx(-2.0 * (1.0 - share))
        assert program.g_lower[2] == 1.0
        tried.append(share)
        solved = bool(share - reached[-1] <= widest)
        reached.extend([share] * solved)
        return Iterate(point.Y, ending=Ending.SOLVED if solved else Ending.ITERATION_LIMIT)

    schedule: Any = SimpleNamespace(transcription=program, solve=solve, at_most=int)
    found = relax_stepwise(schedule, Iterate(np.zeros((3, 1))), np.ones(3, dtype=bool))
    assert tried == pytest.approx(shares)
    assert found.solved == (reached[-1] == 1.0)
    assert (program.g_lower == asked[0]).all() and (program.g_upper == asked[1]).all()
