"""A plan that was solved starts the next one from its own stages, not from its nodes alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kemba.ocp.nlp.ipopt import Control
from kemba.ocp.phases.modes import Phase
from kemba.ocp.phases.program import PhaseProgram
from kemba.ocp.phases.radau import RADAU3, RADAU5, Scheme
from kemba.ocp.phases.stages import Stages
from kemba.ocp.planned import Plan
from kemba.ocp.planning import plans_nearby
from kemba.ocp.reading import load_task, task_model
from kemba.ocp.refinement.refine import Refiner, reduction_of
from kemba.ocp.task.task import Task


@pytest.fixture(scope="module")
def low() -> Plan:
    """A jump of 0.45 m from a shipped plan: it has phases of a single element."""
    task, document = load_task("jump.yaml", ["height=0.45 m"])
    return next(plans_nearby(task, document))


def built(
    low: Plan, task: Task, phases: tuple[Phase, ...], scheme: Scheme
) -> tuple[PhaseProgram, np.ndarray]:
    model = task_model(task)
    half = reduction_of(model, task, low.requirements, low.trajectory)
    refiner = Refiner(model, task, low.requirements, low.trajectory, half, Control())
    return refiner.build(phases, low.trajectory, scheme)


def violation(program: PhaseProgram, x: np.ndarray) -> float:
    g = np.array(program.problem.g(x, [])).ravel()
    over = np.maximum(program.g_lower - g, g - program.g_upper)
    return float(over.max())


def test_its_stages_meet_every_row_and_its_nodes_do_not(low: Plan) -> None:
    assert low.stages is not None and low.stages.nodes == low.task.nodes
    program, x = built(low, low.task, low.stages.phases, RADAU5)
    start = low.stages.start(program)
    assert start is not None and len(start) == len(x)
    assert violation(program, start) < 1e-6
    assert violation(program, x) > 1.0


def test_other_figures_of_the_air_change_it_by_their_part(low: Plan) -> None:
    assert low.stages is not None
    effects = low.task.effects  # of the shipped plan, whose air was fitted
    weaker = [0.98 * F for F in low.model.effect("chamber").F_extend]
    effects = {**effects, "chamber": {**effects.get("chamber", {}), "F_extend": weaker}}
    task = low.task.model_copy(update={"effects": effects})
    program, _ = built(low, task, low.stages.phases, RADAU5)
    start = low.stages.start(program)
    assert start is not None
    assert 1e-4 < violation(program, start) < 0.2


def test_it_starts_no_other_program(low: Plan) -> None:
    assert low.stages is not None
    program, _ = built(low, low.task, low.stages.phases, RADAU3)
    assert low.stages.start(program) is None, "another scheme"
    first = low.stages.phases[0]
    others = (replace(first, valves=(0.0, 1.0)), *low.stages.phases[1:])
    program, _ = built(low, low.task, others, RADAU5)
    assert low.stages.start(program) is None, "other valves"


def test_stages_are_what_was_solved(low: Plan) -> None:
    assert low.stages is not None
    program, _ = built(low, low.task, low.stages.phases, RADAU5)
    start = low.stages.start(program)
    assert start is not None
    again = Stages.of(program, np.append(start, 7.0))  # with a variable of the solve behind it
    np.testing.assert_allclose(again.values, low.stages.values, atol=1e-9)
