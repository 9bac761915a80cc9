"""Start guesses: which there are, and which of their plans are refined."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import casadi as ca
import pytest

from kemba.ocp import Plan, load_task
from kemba.ocp.certificate.status import Status
from kemba.ocp.planner import Planner, searched
from kemba.ocp.planning import Planning, guesses
from kemba.ocp.transcription.parameters import Parameters
from kemba.ocp.transcription.symmetry import whole

TURN = ("cost.calm.expression=body/pitch_rate^2", "cost.calm.weight=2")


def planning(name: str, *changes: str) -> Planning:
    return Planning.of(*load_task(name, list(changes)))


def test_turning_costs_in_some_guesses_of_a_task_that_asks_legs_for_different_things() -> None:
    ahead, spot = (guesses(planning(name).planner) for name in ("jump_forward.yaml", "jump.yaml"))
    assert [bool(guess.turning) for guess in ahead] == [False, True, False, True]
    assert not any(guess.turning for guess in spot)
    assert len(set(ahead)) == len(set(spot)) == 4


def test_turning_costs_only_while_a_plan_is_sought() -> None:
    planner = replace(planning("jump_forward.yaml").planner, turning=3.0)
    sought = planner.schedule(20, whole(planner.model.node)).transcription.task
    assert set(sought.cost) - set(planner.task.cost) == {"turning while sought"}
    assert searched(planner, refused=True).task == planner.task


def test_half_a_robot_knows_costs_of_what_is_zero_by_symmetry() -> None:
    values = []
    for changes in ((), TURN):
        planner = planning("jump.yaml", *changes).planner
        assert planner.half is not None
        half = planner.schedule(20, planner.half).transcription
        nlp = half.problem.nlp
        objective = ca.Function("f", [nlp["x"], nlp["p"]], [nlp["f"]])
        at = planner.guess(half).Y.ravel(), Parameters(1e-3).vector(half.nodes)
        values.append(float(objective(*at)))
    assert values[0] == pytest.approx(values[1])


@pytest.fixture
def refinement(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Which plans of further guesses are refined; all have one order of contacts and valves."""
    refined: list[bool] = []
    known: list[Plan] = []

    def made(planner: Planner, refused: bool, worth: Callable[[Plan], bool]) -> Plan | None:
        if not known:
            known.append(replace(searched(planner, refused=True), status=Status.ACCEPTABLE))
        refined.append(worth(known[0]))
        return known[0] if refined[-1] else None

    monkeypatch.setattr("kemba.ocp.planning.found_and_refined", made)
    return refined


def test_a_plan_of_a_known_order_is_not_refined_again(refinement: list[bool]) -> None:
    found = list(planning("jump.yaml").plans())
    assert refinement == [True, False, False, False] and len(found) == 1


def test_what_is_not_promising_is_not_refined(
    refinement: list[bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    orders = iter(range(100))
    monkeypatch.setattr("kemba.ocp.planning.order_of", lambda *known: [next(orders)])
    asked: list[bool] = []

    def third(found: Plan) -> bool:
        asked.append(len(asked) == 1)
        return asked[-1]

    starts = [found.start for found in planning("jump.yaml").plans(promising=third)]
    assert refinement == [True, False, True, False]
    assert starts == ["guess", "guess 3"]
