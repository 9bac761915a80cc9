"""Refined plans: modes read off a plan, phases solved, and what an independent replay says."""

import time
from dataclasses import replace
from functools import lru_cache
from typing import Any
from unittest.mock import patch

import casadi as ca
import numpy as np
import pytest

from kemba.ocp import Plan, load_task, plan
from kemba.ocp.nlp.ending import Ending
from kemba.ocp.nlp.ipopt import Control
from kemba.ocp.phases.mesh import meshed
from kemba.ocp.phases.modes import OPEN, Phase
from kemba.ocp.phases.radau import RADAU3, RADAU5, Scheme
from kemba.ocp.phases.settings import ModeConstraints, Refining
from kemba.ocp.refinement import Refined, refine
from kemba.ocp.refinement.refine import BEST, NEAREST, Refiner, reduction_of
from kemba.ocp.refinement.repair import merged, misfits, repaired
from kemba.ocp.transcription.solution import arrays
from kemba.ocp.transcription.unilateral import read_constraints
from kemba.plant.replay import replay

CASES = [
    ("jump", "height=0.47 m"),
    ("jump", "height=0.5 m"),
    ("jump", "height=0.65 m"),
    ("jump", "height=0.7 m"),
    ("jump", "height=0.8 m"),
    ("jump", "height=0.9 m"),
    ("max_jump", "height=1.0 m"),
    ("jump", "payload=1 kg"),
    ("jump", "supply=0.6 MPa"),
    ("jump", "supply=0.8 MPa"),
    ("jump", "start.body/x=-5 cm"),
    ("jump_forward", "distance=0.1 m"),
    ("jump_forward", "distance=0.2 m"),
    ("jump_forward", "distance=0.3 m"),
    ("jump_forward", "distance=0.6 m"),
]
QUICK = [CASES[1]]
MARKS = {case: [] if case in QUICK else [pytest.mark.slow] for case in CASES}
EVERY = [pytest.param(*case, marks=marks) for case, marks in MARKS.items()]


@lru_cache
def euler_plan(name: str, override: str) -> Plan:
    """The implicit Euler plan of a task."""
    return plan(*load_task(name, [override, "refine=none"]))


@lru_cache
def both(name: str, override: str) -> tuple[Plan, Refined]:
    """The same, and refined."""
    euler = euler_plan(name, override)
    return euler, refine(euler.model, euler.task, euler.requirements, euler.trajectory)


def refiner(euler: Plan, **control: Any) -> Refiner:
    """What `refine` runs."""
    half = reduction_of(euler.model, euler.task, euler.requirements, euler.trajectory)
    return Refiner(
        euler.model, euler.task, euler.requirements, euler.trajectory, half, Control(**control)
    )


@pytest.mark.parametrize("scheme", [RADAU3, RADAU5])
def test_the_schemes_integrate_polynomials_of_their_order(scheme: Scheme) -> None:
    weights = scheme.butcher[-1]
    for power in range(2 * scheme.stages - 1):
        assert weights @ scheme.points**power == pytest.approx(1 / (power + 1), abs=1e-14)


@pytest.mark.parametrize(("name", "override"), EVERY)
def test_a_refined_plan_replays_within_2_mm_and_2_ms(name: str, override: str) -> None:
    euler, found = both(name, override)
    assert found.trajectory is not None, found.sentence
    done = replay(euler.model, found.trajectory)
    assert abs(done.apex_error_m) <= 2e-3
    assert (done.touchdown_error_s is not None) == (name != "max_jump")
    assert abs(done.touchdown_error_s or 0.0) <= 2e-3
    assert done.landed  # or flies on, as the plan does


@pytest.mark.parametrize(("name", "override"), QUICK)
def test_a_refined_plan_keeps_what_the_task_asks(name: str, override: str) -> None:
    euler, found = both(name, override)
    assert found.certificate is not None and found.trajectory is not None
    assert found.certificate.within(euler.task.tolerances)
    for requirement in euler.requirements:
        if requirement.at is None or (requirement.at == 1.0 and requirement.text.endswith("rest")):
            continue
        value = found.trajectory[requirement.quantity.name][
            requirement.node(len(found.trajectory) - 1)
        ]
        assert requirement.lower - 1e-6 <= value <= requirement.upper + 1e-6, requirement


@pytest.mark.parametrize(("name", "override"), QUICK)
def test_valves_stay_binary_and_dwell(name: str, override: str) -> None:
    euler, found = both(name, override)
    assert found.trajectory is not None
    for quantity in euler.model.inputs.values():
        if quantity.binary:
            valve = found.trajectory[quantity.name]
            assert set(np.unique(valve)) <= {0.0, 1.0}
            between = np.diff(found.trajectory.time[np.flatnonzero(np.diff(valve))])
            assert between.min(initial=np.inf) >= euler.task.min_dwell - 1e-6


def test_closed_contacts_do_not_drift_even_on_few_nodes() -> None:
    """Held by their rates alone, feet sank by 7 nm until the end of this jump, and by 5 um in a
    backflip."""
    euler = plan(*load_task("jump", ["height=0.5 m", "nodes=50", "refine=none"]))
    found = refine(euler.model, euler.task, euler.requirements, euler.trajectory)
    assert found.stages is not None and found.trajectory is not None
    assert found.stages.stages == 3
    assert np.abs(found.trajectory["front/foot/z"][-1]) < 1e-11


def test_a_phase_gets_elements_by_how_long_it_lasts() -> None:
    """A phase read off a single node would last two nominal steps at most."""
    phases = [Phase(0, 1, (1,), (0.0,)), Phase(1, 9, (0,), (0.0,)), Phase(9, 10, (1,), (0.0,))]
    found = meshed(phases, [3.0, 4.0, 3.0], 20, [0.0, 1.0])
    assert found is not None
    assert [p.elements for p in found] == [6, 8, 6]
    assert [(p.modes, p.valves) for p in found] == [(p.modes, p.valves) for p in phases]
    assert meshed(phases, [3.0, 4.0, 3.0], 2, [0.0, 1.0]) is None
    assert meshed(phases, [3.0, 4.0, 3.0], 20, [0.5]) is None  # inside a phase


def test_phases_cover_the_motion_and_touch_down_once_for_a_clean_jump() -> None:
    euler, found = both(*CASES[1])
    firsts = [phase.first for phase in found.phases]
    assert firsts[0] == 0 and found.phases[-1].last == len(euler.trajectory) - 1
    assert firsts[1:] == [phase.last for phase in found.phases[:-1]]


def test_a_stop_that_the_task_has_touched_at_an_end_need_not_be_clear_at_once() -> None:
    """It may be left with the first element: clear of it from there on no motion could be."""
    euler, found = both(*CASES[1])
    opened = [replace(phase, modes=(phase.modes[0], OPEN, OPEN)) for phase in found.phases]
    program, _ = refiner(euler).build(opened, euler.trajectory, RADAU3)
    last, away = program.nodes, ModeConstraints.away
    clear = [row.node for row in program.rows if "end_stop" in row.label and row.lower > 0.0]
    assert set(clear) == set(range(away + 1, last - away + 1))


@pytest.mark.parametrize(("name", "override"), QUICK)
def test_open_gaps_keep_clear_away_from_touches(name: str, override: str) -> None:
    euler, found = both(name, override)
    assert found.trajectory is not None
    half = reduction_of(euler.model, euler.task, euler.requirements, euler.trajectory)
    x, node = arrays(euler.model, found.trajectory), euler.model.node
    away, clear = ModeConstraints.away, ModeConstraints.clear
    for i, constraint in enumerate(read_constraints(euler.model, half)):
        gap = ca.Function("gap", [node.q], [constraint.gap]).map(len(x["q"]))
        values = np.array(gap(x["q"].T)).ravel()[1:]
        closed = np.array([p.active(i) for p in found.phases for _ in range(p.elements)])
        beyond = np.pad(closed, away, constant_values=True)
        free = [not beyond[e : e + 2 * away + 1].any() for e in range(len(closed))]
        assert values[free].min(initial=np.inf) >= clear - 1e-9


def test_the_half_robot_has_one_foot_and_two_stops() -> None:
    euler, _ = both(*CASES[1])
    half = reduction_of(euler.model, euler.task, euler.requirements, euler.trajectory)
    assert half.symmetric
    constraints = read_constraints(euler.model, half)
    assert [c.label for c in constraints] == [
        "front/contact:gap",
        "front/end_stop:retracted",
        "front/end_stop:extended",
    ]
    assert [c.friction is not None for c in constraints] == [True, False, False]


@pytest.mark.slow
def test_the_task_key_makes_the_refined_plan_the_plan() -> None:
    task, document = load_task("jump", ["refine=radau"])
    found = plan(task, document)
    assert found.status == "solved" and "phases of contacts and valves" in found.sentence
    assert found.attempts[-1].name == "phases"
    assert abs(replay(found.model, found.trajectory).apex_error_m) <= 2e-3


def wrong_touch(phases: tuple[Phase, ...], marks: list[int]) -> tuple[int, list[Phase]]:
    """Phases with a foot down for one interval in the middle of the longest flight."""
    p = max((q for q, phase in enumerate(phases) if phase.modes[0] == OPEN),
            key=lambda q: phases[q].elements)  # fmt: skip
    flight = phases[p]
    k = next(k for k in range(flight.first + 2, flight.last - 2) if k not in marks)
    parts = [replace(flight, last=k), replace(flight, first=k, last=k + 1),
             replace(flight, first=k + 1)]  # fmt: skip
    parts[1] = replace(parts[1], modes=(1, *flight.modes[1:]))
    return k, [*phases[:p], *parts, *phases[p + 1 :]]


def test_a_contact_that_cannot_be_is_found_and_taken_out() -> None:
    euler, found = both(*CASES[1])
    tried = refiner(euler)
    k, wrong = wrong_touch(found.phases, tried.marks(len(euler.trajectory) - 1))
    program, near = tried.elastic(wrong, euler.trajectory, NEAREST)
    program, near = tried.elastic(wrong, (program, near.Y), BEST)  # modes are judged from here on
    violated = misfits(program, near.Y)
    worst = max(violated, key=lambda misfit: misfit.size)
    assert (worst.constraint, worst.element, worst.kind) == (0, k, "touch")
    assert repaired(program, violated, tried.marks(len(euler.trajectory) - 1)) == list(found.phases)


def test_other_phases_on_the_same_elements_begin_where_the_old_ones_are() -> None:
    euler, found = both(*CASES[1])
    assert found.stages is not None
    tried = refiner(euler)
    program, _ = tried.build(found.phases, euler.trajectory, RADAU5)
    x = found.stages.start(program)
    assert x is not None
    _, others = wrong_touch(found.phases, tried.marks(len(euler.trajectory) - 1))
    split, y = tried.build(others, (program, x), RADAU5)
    for e in range(program.nodes):
        for old, new in zip(program.columns.stages[e], split.columns.stages[e], strict=True):
            for group in ("q", "v", "s"):
                np.testing.assert_allclose(y[new[group]], x[old[group]], atol=1e-6)


def test_merging_keeps_borders_where_the_task_asks_for_something() -> None:
    a, b, c = (Phase(i, i + 1, (0,), (1.0,)) for i in range(3))
    assert merged([a, b, c], []) == [Phase(0, 3, (0,), (1.0,))]
    assert merged([a, b, c], [2]) == [Phase(0, 2, (0,), (1.0,)), c]
    assert merged([a, replace(b, valves=(0.0,)), c], []) == [a, replace(b, valves=(0.0,)), c]


@pytest.mark.parametrize("enough", [0, 5])
def test_refining_stops_when_asked_and_tells_every_iteration(enough: int) -> None:
    euler, heard = euler_plan(*CASES[1]), []
    found = refine(
        euler.model,
        euler.task,
        euler.requirements,
        euler.trajectory,
        control=Control(
            watch=lambda iteration, objective, violation: heard.append((iteration, violation)),
            stop=lambda: len(heard) >= enough,
        ),
    )
    assert found.ending is Ending.INTERRUPTED and found.trajectory is None
    assert [iteration for iteration, _ in heard] == list(range(enough))
    assert all(violation > 0.0 for _, violation in heard)


def test_refining_ends_at_its_deadline() -> None:
    euler = euler_plan(*CASES[1])
    late = Control(deadline=time.monotonic() - 1.0)
    found = refine(euler.model, euler.task, euler.requirements, euler.trajectory, control=late)
    assert not found.solved and found.ending is Ending.TIME_LIMIT


def test_refining_spends_no_more_iterations_than_it_may() -> None:
    euler = euler_plan(*CASES[1])
    with patch.object(Refining, "iterations", 7):
        found = refine(euler.model, euler.task, euler.requirements, euler.trajectory)
    assert not found.solved and 0 < found.iterations <= 7


def test_a_plan_interrupted_while_refining_is_the_implicit_euler_plan() -> None:
    task, document = load_task("jump", ["nodes=60", "solver.coarse=false"])
    said: list[str] = []
    refining = lambda: any(stage.startswith("phases") for stage in said)  # noqa: E731
    found = plan(task, document, tell=said.append, stop=refining)
    assert found.status == "interrupted"
    assert "interrupted while refining, the implicit Euler plan is kept" in found.sentence
    assert found.certificate.within(task.tolerances)
    assert found.attempts[-1].ending is Ending.INTERRUPTED
