"""A plan on many nodes is sought on fewer; its solution starts the finer program."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from kemba.ocp import finer, planned
from kemba.ocp.certificate.certify import objective
from kemba.ocp.certificate.status import Status
from kemba.ocp.continuation.continue_plan import renoded
from kemba.ocp.nlp.ending import Ending
from kemba.ocp.nlp.ipopt import Control
from kemba.ocp.phases.program import PhaseProgram
from kemba.ocp.phases.radau import RADAU5
from kemba.ocp.phases.stages import Stages
from kemba.ocp.planned import Plan
from kemba.ocp.planning import plan
from kemba.ocp.reading import load_task
from kemba.ocp.refinement.refine import Refiner, reduction_of
from kemba.ocp.refinement.start import on_elements


@pytest.fixture(scope="module")
def coarse() -> Plan:
    """The 0.5 m jump on 100 nodes."""
    return plan(*load_task("jump.yaml"))


def on(nodes: int, coarse: Plan) -> tuple[PhaseProgram, Stages]:
    """The program of the same phases on other nodes; what was solved."""
    assert coarse.stages is not None
    meshed = renoded(coarse.trajectory, coarse.stages.phases, nodes, [0.0, 0.5, 1.0], even=False)
    assert meshed is not None
    start, phases = meshed
    half = reduction_of(coarse.model, coarse.task, coarse.requirements, start)
    refiner = Refiner(coarse.model, coarse.task, coarse.requirements, start, half, Control())
    return refiner.build(phases, start, RADAU5)[0], coarse.stages


def errors(program: PhaseProgram, x: np.ndarray, kind: str = "") -> float:
    """The largest violation of rows whose label begins with `kind`."""
    g = np.array(program.problem.g(x, [])).ravel()
    over = np.maximum(program.g_lower - g, g - program.g_upper)
    return float(max(over[i] for i, row in enumerate(program.rows) if row.label.startswith(kind)))


def test_phases_keep_their_share_of_the_nodes(coarse: Plan) -> None:
    program, solved = on(200, coarse)
    assert [2 * p.elements for p in solved.phases] == [p.elements for p in program.phases]
    uneven, _ = on(130, coarse)
    for p, q in zip(solved.phases, uneven.phases, strict=True):
        assert abs(1.3 * p.elements - q.elements) <= 1.0


def test_the_same_elements_are_the_same_point(coarse: Plan) -> None:
    program, solved = on(100, coarse)
    start = on_elements(program, solved)
    assert start is not None and errors(program, start) < 1e-6


def test_finer_elements_read_the_polynomials_of_the_coarser(coarse: Plan) -> None:
    """Nodes on a straight line would violate rows by several times their scale."""
    program, solved = on(200, coarse)
    start = on_elements(program, solved)
    assert start is not None
    assert errors(program, start) < 0.2
    assert errors(program, start, "kinematics") < 1e-2
    c = program.columns
    for phase, before in zip(program.phases, solved.phases, strict=True):
        old = solved.scaled(program)
        assert old is not None
        ends = c.end(phase.last)["q"], old[0].end(before.last)["q"]
        np.testing.assert_allclose(start[ends[0]], old[1][ends[1]], atol=1e-9)


def test_what_must_stay_apart_is_the_same_on_finer_grids(coarse: Plan) -> None:
    """Near a touch gaps may be small for a time, not for a number of elements."""
    program, solved = on(400, coarse)
    start = on_elements(program, solved)
    assert start is not None
    assert errors(program, start, "front/end_stop:retracted gap") < 1e-3


@pytest.mark.slow
def test_no_solve_from_a_guess_is_made_on_many_nodes() -> None:
    task, document = load_task("jump.yaml", ["nodes=160"])
    told: list[str] = []
    found = plan(task, document, tell=lambda text: told.append(str(text)))
    assert found.refined and len(found.trajectory) == 161
    assert "from the plan on 100 nodes" in found.sentence
    assert any("100 nodes)" in text for text in told)
    assert not any("160 nodes)" in text for text in told)
    assert found.attempts[-1].name == "from the earlier plan"
    fewer = plan(*load_task("jump.yaml", ["nodes=100"]))
    costs = [objective(f.model, f.task, f.requirements, f.trajectory) for f in (found, fewer)]
    assert costs[0] < 1.1 * costs[1]


@pytest.mark.slow
def test_the_coarser_plan_is_kept_where_a_user_stops_on_many_nodes() -> None:
    task, document = load_task("jump.yaml", ["nodes=160"])
    told: list[str] = []

    def stop() -> bool:
        return bool(told) and "from the plan on 100 nodes" in told[-1]

    found = plan(task, document, tell=lambda text: told.append(str(text)), stop=stop)
    assert found.status == "interrupted" and found.refined and len(found.trajectory) == 101
    assert "interrupted before it was solved on 160 nodes, 100 are kept" in found.sentence


@pytest.mark.parametrize(("torque", "said"), [(8.0, False), (13.0, True)])
def test_a_plan_that_costs_over_thrice_the_earlier_one_is_said_to(
    torque: float, said: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """4 before: 8 are twice as many, 13 over three times."""
    known: Any = SimpleNamespace(
        missed=(), within=lambda _: True, trajectory="new", ending=Ending.SOLVED, phases=(),
        sentence="", stages=None, steps=[], size=(1, 1), dear="which is cheaper", name="the run",
        run="", plan="old", model=None,
    )  # fmt: skip
    known.certificate, known.run = known, lambda: known
    monkeypatch.setattr(finer, "Continuation", lambda *_: known)
    monkeypatch.setattr(planned, "verdict", lambda *_: (Status.SOLVED, "solved"))
    for module in (finer, planned):
        monkeypatch.setattr(
            module, "costs", lambda _, plan: {finer.TORQUE: 4.0 if plan == "old" else torque}
        )
    task = SimpleNamespace(refine="radau", tolerances=None)
    session = SimpleNamespace(control=None, tell=None, attempts=[])
    planner: Any = SimpleNamespace(session=session, task=task, model=None, requirements=[])
    found = finer.continued(planner, known)[0]
    assert found is not None and ("times the squared torque" in found.sentence) is said
