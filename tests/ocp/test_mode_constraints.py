"""Rows of the phases' program, built for a plan and read without solving it."""

from functools import cache

import casadi as ca
import numpy as np
import pytest
from ocp.runs import solved

from kemba.config import load_yaml
from kemba.ocp.nlp.ipopt import Control
from kemba.ocp.phases.modes import read_phases
from kemba.ocp.phases.program import PhaseProgram
from kemba.ocp.phases.radau import RADAU3
from kemba.ocp.refinement.refine import Refiner, reduction_of
from kemba.ocp.task.requirement import Requirement, quantities
from kemba.ocp.task.resolve import resolve
from kemba.ocp.transcription.solution import arrays
from kemba.ocp.transcription.unilateral import read_constraints


@cache
def built() -> tuple[PhaseProgram, np.ndarray]:
    """The program of a jump's phases, and its start: the implicit Euler plan."""
    run = solved("jump")
    model, task, plan = run.model, run.task, run.plan
    requirements = resolve(task, model, load_yaml(run.run.task))
    half = reduction_of(model, task, requirements, plan)
    refiner = Refiner(model, task, requirements, plan, half, Control())
    binary = np.array([q.binary for q in model.inputs.values()])
    inputs = half.restrict("u", arrays(model, plan)["u"])
    valves = np.round(inputs[:, half.B["u"][binary].any(axis=0)])
    marks = refiner.marks(len(plan) - 1)
    phases = read_phases(model, read_constraints(model, half), plan, valves, marks)
    return refiner.build(phases, plan, RADAU3)


def values(label: str) -> tuple[np.ndarray, float, float]:
    """Values of the rows called `label` at the start, and the bounds they must keep."""
    program, x = built()
    (part,) = (part for part in program.added if part.labels == (label,))
    g = ca.Function("g", [part.z], [part.g])
    return np.array([float(g(x[c])) for c in part.columns]), part.lower, part.upper


def test_a_foot_comes_down_where_it_touches() -> None:
    """The rate of the gap before the touch, in m/s, falls at 0.3 m/s or faster."""
    rates, low, high = values("front/contact:gap approach")
    assert (low, high) == (-np.inf, pytest.approx(-0.3))
    assert len(rates) == 1 and -5.0 < rates[0] < -0.3


def test_a_foot_touches_at_no_height() -> None:
    """The row is the gap, in 0.1 m, that the implicit Euler plan closes within the next step."""
    gaps, low, high = values("front/contact:gap touch")
    assert (low, high) == (0.0, 0.0)
    heights = solved("jump").plan["front/foot/z"]
    last = np.flatnonzero(heights > 1e-4)[-1]  # the foot in the air
    assert gaps == pytest.approx([heights[last] / 0.1], rel=1e-6)
    assert heights[last] < 0.03 and np.abs(heights[last + 1 :]).max() < 1e-5


def test_open_gaps_stay_open() -> None:
    program, _ = built()
    bounds = {(r.lower, r.upper) for r in program.rows if r.label == "front/contact:gap gap"}
    low, high = zip(*sorted(bounds), strict=True)
    assert low == pytest.approx((0.0, 2e-3)) and high == (np.inf, np.inf)  # of 0.1 m, near, away


def test_valves_dwell_between_their_switches() -> None:
    """Each row is the share of the nominal duration between two switches of one valve."""
    program, _ = built()
    task, rows = program.task, [r for r in program.rows if r.label == "dwell"]
    assert rows
    for row in rows:
        assert row.lower * task.duration == pytest.approx(task.min_dwell) and row.upper == np.inf


def test_the_motion_lasts_what_the_task_allows() -> None:
    program, _ = built()
    (row,) = (r for r in program.rows if r.label == "duration")
    assert (row.lower, row.upper) == pytest.approx((0.8, 1.2))


@pytest.mark.parametrize("moment", [0.0, 0.5, 1.0])
def test_what_is_to_be_as_large_as_possible_may_be_so_at_any_moment(moment: float) -> None:
    """At the first node there are neither inputs nor forces to read."""
    run = solved("jump")
    fast = Requirement(
        ("goals", "fast"), quantities(run.model)["body/vx"], moment, -np.inf, np.inf, aim=1
    )
    half = reduction_of(run.model, run.task, [fast], run.plan)
    refiner = Refiner(run.model, run.task, [fast], run.plan, half, Control())
    program, x = refiner.build(refiner.phases(), run.plan, RADAU3)
    assert x.size == program.problem.hess_lag.size1_out(0)
    slope = np.array(program.problem.grad_f(x, [])[1]).ravel()
    at = program.columns.end(round(moment * program.nodes))["v"]
    names = [q.name for q in run.model.mechanism.velocities]
    assert [names[i] for i in np.flatnonzero(slope[at] < 0.0)] == ["body/vx"]
