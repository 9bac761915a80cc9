"""A plan that was solved starts the next one from its own stages, not from its nodes alone."""

from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from kemba.ocp.certificate.certify import objective
from kemba.ocp.continuation.continue_plan import Continuation
from kemba.ocp.continuation.origin import Origin, read_stages, write_stages
from kemba.ocp.nlp.ipopt import Control, Iterate
from kemba.ocp.phases.modes import Phase
from kemba.ocp.phases.program import PhasePart, PhaseProgram
from kemba.ocp.phases.radau import RADAU3, RADAU5, Scheme
from kemba.ocp.phases.stages import Stages
from kemba.ocp.planned import Plan
from kemba.ocp.planning import plan
from kemba.ocp.reading import load_task, task_model
from kemba.ocp.refinement.refine import Refiner, reduction_of
from kemba.ocp.task.resolve import resolve
from kemba.ocp.task.task import Task
from kemba.runs import STAGES


@pytest.fixture(scope="module")
def low() -> Plan:
    """A jump of 0.5 m."""
    return plan(*load_task("jump.yaml", ["height=0.5 m"]))


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
    weaker = [0.98 * F for F in low.model.effect("chamber").F_extend]
    task = low.task.model_copy(update={"effects": {"chamber": {"F_extend": weaker}}})
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
    again = Stages.of(program, Iterate(np.append(start, 7.0)))  # a variable of the solve behind it
    np.testing.assert_allclose(again.values, low.stages.values, atol=1e-9)


def test_multipliers_find_their_rows_in_a_program_with_more(low: Plan) -> None:
    assert low.stages is not None
    program, x = built(low, low.task, low.stages.phases, RADAU5)
    more, _ = built(low, low.task, low.stages.phases, RADAU5)
    foot, node = more.columns.first["q"], 0
    more.added.insert(0, PhasePart(("new",), *one_row(), 0.0, 1.0, foot[None, :1]))
    begun, wider = low.stages.iterate(program, x), low.stages.iterate(more, x)
    assert begun.lam_g is not None and wider.lam_g is not None
    assert np.count_nonzero(begun.lam_g) > 100, "they are those of the solve"
    new = [row.label == "new" for row in more.rows]
    assert sum(new) == 1 and wider.lam_g[new] == 0.0 and more.rows[new.index(True)].node == node
    np.testing.assert_array_equal(np.delete(wider.lam_g, new.index(True)), begun.lam_g)


def one_row() -> tuple[ca.SX, ca.SX, ca.SX]:
    z = ca.SX.sym("z")
    return z, z, ca.SX(0)


def test_a_run_keeps_them(low: Plan, tmp_path: Path) -> None:
    assert low.stages is not None
    write_stages(tmp_path / STAGES, low.stages)
    read = read_stages(tmp_path / STAGES)
    assert read is not None and (read.phases, read.stages) == (low.stages.phases, 3)
    np.testing.assert_array_equal(read.values, low.stages.values)
    np.testing.assert_array_equal(read.of_bounds, low.stages.of_bounds)
    np.testing.assert_equal(read.of_rows, dict(low.stages.of_rows))


@pytest.mark.parametrize("content", [None, b"", b"PK\x03\x04 cut", b"no archive"])
def test_a_file_that_cannot_be_read_is_as_none(tmp_path: Path, content: bytes | None) -> None:
    if content is not None:
        (tmp_path / STAGES).write_bytes(content)
    assert read_stages(tmp_path / STAGES) is None


def test_a_kept_file_without_numbers_is_as_none(low: Plan, tmp_path: Path) -> None:
    assert low.stages is not None
    write_stages(tmp_path / STAGES, replace(low.stages, values=np.full(3, np.nan)))
    assert read_stages(tmp_path / STAGES) is None
    np.savez(tmp_path / STAGES, values=np.zeros(3))
    assert read_stages(tmp_path / STAGES) is None


def test_with_and_without_multipliers_the_changed_plan_is_the_same(low: Plan) -> None:
    task, document = load_task("jump.yaml", ["height=0.51 m"])
    asked = tuple(resolve(task, low.model, document))
    found = {}
    assert low.stages is not None
    without = replace(low.stages, of_bounds=np.zeros(0))
    for name, stages in {"with": low.stages, "without": without}.items():
        origin = Origin(low.trajectory, low.model, low.requirements, stages=stages)
        found[name] = Continuation(low.model, task, asked, origin, Control()).run()
    assert all(f.solved for f in found.values())
    costs = [
        objective(low.model, task, asked, f.trajectory) for f in found.values() if f.trajectory
    ]
    assert costs[0] == pytest.approx(costs[1], rel=1e-3)
