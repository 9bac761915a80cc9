"""Refined plans: modes read off a plan, phases solved, and what an independent replay says."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from kemba.ocp import Plan, load_task, plan
from kemba.ocp.phases import Refined, refine
from kemba.ocp.phases.constraints import read_constraints
from kemba.ocp.phases.radau import RADAU3, RADAU5, Scheme
from kemba.ocp.phases.refine import reduction_of
from kemba.ocp.switching import switching
from kemba.plant.replay import replay

CASES = [
    ("jump", "height=0.35 m"),
    ("jump", "height=0.5 m"),
    ("jump", "height=0.7 m"),
    ("max_jump", "height=1.0 m"),
]
QUICK = [CASES[1], CASES[3]]
EVERY = [case if case in QUICK else pytest.param(*case, marks=pytest.mark.slow) for case in CASES]


@lru_cache
def both(name: str, height: str) -> tuple[Plan, Refined]:
    """The implicit Euler plan of a task, and the same refined."""
    task, document = load_task(name, [height])
    euler = plan(task, document)
    return euler, refine(euler.model, task, euler.wishes, euler.trajectory)


@pytest.mark.parametrize("scheme", [RADAU3, RADAU5])
def test_the_schemes_integrate_polynomials_of_their_order(scheme: Scheme) -> None:
    weights = scheme.butcher[-1]
    for power in range(2 * scheme.stages - 1):
        assert weights @ scheme.points**power == pytest.approx(1 / (power + 1), abs=1e-14)


@pytest.mark.parametrize(("name", "height"), EVERY)
def test_a_refined_plan_replays_within_2_mm_and_2_ms(name: str, height: str) -> None:
    euler, found = both(name, height)
    assert found.trajectory is not None, found.message
    done = replay(euler.model, found.trajectory)
    assert abs(done.apex_error_m) <= 2e-3
    planned_touchdown = name == "jump" and height != "height=0.35 m"
    assert (done.touchdown_error_s is not None) == planned_touchdown
    assert abs(done.touchdown_error_s or 0.0) <= 2e-3
    assert done.landed == (name == "jump")


@pytest.mark.parametrize(("name", "height"), QUICK)
def test_a_refined_plan_keeps_what_the_task_asks(name: str, height: str) -> None:
    euler, found = both(name, height)
    assert found.certificate is not None and found.trajectory is not None
    assert found.certificate.within(euler.task.tolerances)
    for wish in euler.wishes:
        if wish.at is None or (wish.at == 1.0 and wish.text.endswith("rest")):
            continue
        value = found.trajectory[wish.quantity.name][wish.node(len(found.trajectory) - 1)]
        assert wish.lower - 1e-6 <= value <= wish.upper + 1e-6, wish


@pytest.mark.parametrize(("name", "height"), QUICK)
def test_valves_stay_binary_and_dwell(name: str, height: str) -> None:
    euler, found = both(name, height)
    assert found.trajectory is not None
    for quantity in euler.model.inputs.values():
        if quantity.binary:
            assert set(np.unique(found.trajectory[quantity.name])) <= {0.0, 1.0}
    assert switching(euler.model, found.trajectory)["shortest_dwell_s"] >= (
        euler.task.min_dwell - 1e-6
    )


def test_phases_cover_the_motion_and_touch_down_once_for_a_clean_jump() -> None:
    euler, found = both(*CASES[1])
    firsts = [phase.first for phase in found.phases]
    assert firsts[0] == 0 and found.phases[-1].last == len(euler.trajectory) - 1
    assert firsts[1:] == [phase.last for phase in found.phases[:-1]]


def test_the_half_robot_has_one_foot_and_two_stops() -> None:
    euler, _ = both(*CASES[1])
    half = reduction_of(euler.model, euler.task, euler.wishes, euler.trajectory)
    assert half.symmetric
    constraints = read_constraints(euler.model, half)
    assert [c.label for c in constraints] == [
        "front/contact:gap",
        "front/end_stop:retracted",
        "front/end_stop:extended",
    ]
    assert [c.friction is not None for c in constraints] == [True, False, False]


def test_the_task_key_makes_the_refined_plan_the_plan() -> None:
    task, document = load_task("jump", ["refine=radau"])
    found = plan(task, document)
    assert found.status == "solved" and "refined on" in found.sentence
    assert found.attempts[-1].name == "phases"
    assert abs(replay(found.model, found.trajectory).apex_error_m) <= 2e-3
