"""What holds along a motion holds between nodes as well, where a solution would miss it."""

from functools import cache

import numpy as np
import pytest

from kemba.ocp.certificate.asked import measured
from kemba.ocp.nlp.ipopt import Control, Iterate
from kemba.ocp.phases.between import add_missed
from kemba.ocp.phases.program import PhaseProgram
from kemba.ocp.phases.radau import RADAU3, RADAU5
from kemba.ocp.planned import Plan
from kemba.ocp.planning import plan
from kemba.ocp.reading import load_task
from kemba.ocp.refinement.refine import Refiner, reduction_of
from kemba.ocp.refinement.start import solve_along, to_trajectory, warm
from kemba.ocp.task.requirement import Requirement, quantities
from kemba.scene.scene import Obstacle

BOX = Obstacle.model_validate({"from": "2 m", "to": "2.1 m", "height": "0.1 m"})  # far ahead


@cache
def jump() -> Plan:
    return plan(*load_task("jump.yaml", ["height=0.5 m", "nodes=60"]))


def program_of(asked: list[Requirement], within: float) -> tuple[PhaseProgram, np.ndarray]:
    """The program of that jump with other requirements, of which between nodes `within` [m] may be
    missed, and the jump as its start."""
    found = jump()
    assert found.stages is not None
    tolerances = found.task.tolerances.model_copy(update={"apex": within})
    task = found.task.model_copy(update={"tolerances": tolerances})
    half = reduction_of(found.model, task, asked, found.trajectory)
    refiner = Refiner(found.model, task, asked, found.trajectory, half, Control())
    program, _ = refiner.build(found.stages.phases, found.trajectory, RADAU5)
    x = found.stages.start(program)
    assert x is not None
    return program, x


def no_higher() -> list[Requirement]:
    """The jump's requirements, and knees that are never higher than 1 mm below their highest node:
    kept at nodes, it is missed between them by 0.1 mm."""
    found = jump()
    knees = [q for name, q in quantities(found.model).items() if name.endswith("/knee/z")]
    high = float(found.trajectory["front/knee/z"].max()) - 1e-3
    bounds = [Requirement(("bounds", "knee"), q, None, -np.inf, high) for q in knees]
    return [*found.requirements, *bounds]


def test_a_plan_that_keeps_to_its_bounds_is_left_as_it_is() -> None:
    asked = list(jump().requirements)
    program, x = program_of(asked, jump().task.tolerances.apex)
    rows = len(program.rows)
    assert not add_missed(program, x) and len(program.rows) == rows


def test_what_is_missed_between_nodes_is_kept_after_another_solve() -> None:
    asked = no_higher()
    program, x = program_of(asked, 1e-6)
    before = measured(program.model, program.task, asked, to_trajectory(program, x))
    missed = [m for m in before if m.text.startswith("bounds.knee") and not m.met]
    assert missed, "else there is nothing to be mended"
    rows = len(program.rows)
    found = solve_along(program, Iterate(x), warm(60), Control())
    assert found.solved and len(program.rows) > rows
    after = measured(program.model, program.task, asked, to_trajectory(program, found.Y))
    assert all(m.met for m in after if m.text.startswith("bounds.knee"))


def test_where_nothing_keeps_to_it_the_solution_without_stays(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = no_higher()
    program, x = program_of(asked, 2e-6)
    rows = len(program.rows)
    monkeypatch.setattr("kemba.ocp.refinement.start.warm", lambda iterations: warm(0))
    found = solve_along(program, Iterate(x), warm(60), Control())
    assert found.solved and len(program.rows) == rows


@pytest.mark.parametrize(("obstacles", "beside"), [([], False), ([BOX], True)])
def test_beside_corners_rows_between_nodes_stand_from_the_start(
    obstacles: list[Obstacle], beside: bool
) -> None:
    """Of the coarser scheme and of elastic programs too: knees 3 mm below where they may not be."""
    found = jump()
    task = found.task.model_copy(update={"obstacles": tuple(obstacles)})
    knees = [q for name, q in quantities(found.model).items() if name.endswith("/knee/z")]
    high = float(found.trajectory["front/knee/z"].max()) + 3e-3
    bounds = [Requirement(("bounds", "knee"), q, None, -np.inf, high) for q in knees]
    asked = [*found.requirements, *bounds]
    half = reduction_of(found.model, task, asked, found.trajectory)
    refiner = Refiner(found.model, task, asked, found.trajectory, half, Control())
    assert found.stages is not None
    for price in (0.0, 1.0):
        program, _ = refiner.build(found.stages.phases, found.trajectory, RADAU3, price)
        assert any("knee" in row.label and "between" in row.label for row in program.rows) is beside
