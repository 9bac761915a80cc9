"""Pulses that lower the cost: where multipliers see them, and what becomes of a plan with them."""

from functools import cache

import numpy as np
import pytest

from kemba.ocp import load_task
from kemba.ocp.certificate.certify import objective
from kemba.ocp.nlp.ipopt import Control, Iterate
from kemba.ocp.phases.modes import Phase
from kemba.ocp.phases.program import PhaseProgram
from kemba.ocp.phases.radau import RADAU5
from kemba.ocp.planned import Plan
from kemba.ocp.planning import Planning
from kemba.ocp.refinement import repair
from kemba.ocp.refinement.refine import Refiner, reduction_of
from kemba.ocp.refinement.repair import Pulse, inserted, pulses, reduced_costs
from kemba.ocp.refinement.start import carried, solve, warm


@cache
def without() -> Plan:
    """A jump of 0.71 m at 0.66 MPa, without pulses put in."""
    task, document = load_task("jump.yaml", ["height=0.71 m", "supply=0.66 MPa"])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(repair, "FAILS", 0)
        return next(Planning.of(task, document).plans())


@cache
def solved() -> tuple[Refiner, PhaseProgram, Iterate]:
    plan = without()
    assert plan.stages is not None
    half = reduction_of(plan.model, plan.task, plan.requirements, plan.trajectory)
    refiner = Refiner(plan.model, plan.task, plan.requirements, plan.trajectory, half, Control())
    program, _ = refiner.build(plan.stages.phases, plan.trajectory, RADAU5)
    x = plan.stages.start(program)
    assert x is not None
    return refiner, program, solve(program, Iterate(x), warm(60), Control())


def test_reduced_costs_are_the_slope_of_the_lagrangian() -> None:
    """A phase has one column for each of its valves: what its elements say adds up to its slope."""
    _, program, found = solved()
    assert found.lam_g is not None
    rows = program.parts[0].columns.shape[0] * program.parts[0].g.numel()
    slope = np.array(program.problem.jac_g(found.Y, [])[1].T @ np.where(
        np.arange(len(found.lam_g)) < rows, found.lam_g, 0.0
    )).ravel() + np.array(program.problem.grad_f(found.Y, [])[1]).ravel()  # fmt: skip
    costs = reduced_costs(program, found)
    at = [c - program.layout.slices["u"].start for c in program.layout.binary]
    for phase in program.phases:
        sign = 1.0 - 2.0 * np.array(phase.valves)
        whole = slope[program.columns.u[phase.first, at]]
        assert costs[phase.first : phase.last].sum(axis=0) == pytest.approx(sign * whole, abs=1e-9)


def test_a_pulse_splits_its_phase_and_keeps_the_motion() -> None:
    refiner, program, found = solved()
    best = pulses(program, found)[0]
    phases = inserted(program.phases, best)
    assert [p.valves for p in phases if (p.first, p.last) == (best.first, best.last)] != []
    longer, _ = refiner.build(phases, without().trajectory, RADAU5)
    y = carried(longer, program.columns, program.scheme.points, found.Y)
    for before, after in zip(program.columns.stages, longer.columns.stages, strict=True):
        for g in after[-1]:
            assert np.allclose(found.Y[before[-1][g]], y[after[-1][g]], atol=1e-9)
    off = np.array(longer.problem.g(y, [])).ravel()
    over = np.maximum(off - longer.g_upper, longer.g_lower - off) > 1e-6
    changed = {longer.rows[i].node for i in np.flatnonzero(over)}
    assert changed == set(range(best.first + 1, best.last + 1))


def test_at_the_ends_of_a_phase_nothing_is_cut_off() -> None:
    phases = [Phase(0, 4, (1,), (0.0, 1.0)), Phase(4, 6, (0,), (0.0, 1.0))]
    found = inserted(phases, Pulse(0, 1, 2, 4, 1.0))
    assert [(p.first, p.last, p.valves) for p in found] == [
        (0, 2, (0.0, 1.0)), (2, 4, (0.0, 0.0)), (4, 6, (0.0, 1.0))
    ]  # fmt: skip


def test_a_plan_gets_cheaper_and_stays_what_was_asked() -> None:
    before = without()
    after = next(Planning.of(before.task).plans())
    costs = [objective(p.model, p.task, p.requirements, p.trajectory) for p in (before, after)]
    assert costs[1] < 0.5 * costs[0]
    assert after.status == "solved" and after.certificate.within(after.task.tolerances)


def test_the_plan_without_pulses_comes_next() -> None:
    """For executions that do not follow the pulses."""
    plans = Planning.of(without().task).plans()
    after, plain = next(plans), next(plans)
    assert (after.start, plain.start) == ("guess", "guess, without further pulses")
    assert plain.stages is not None and after.stages is not None
    assert len(plain.stages.phases) < len(after.stages.phases)
    costs = [objective(p.model, p.task, p.requirements, p.trajectory) for p in (without(), plain)]
    assert costs[1] == pytest.approx(costs[0], rel=0.01) and plain.status == "solved"
