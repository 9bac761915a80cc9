"""Start guesses: which of their plans are refined."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from kemba.ocp import Plan, load_task
from kemba.ocp.certificate.status import Status
from kemba.ocp.infeasibility.explain import Relax
from kemba.ocp.planner import Planner, searched
from kemba.ocp.planning import Planning
from kemba.ocp.refinement import order_of
from kemba.ocp.transcription.symmetry import whole
from kemba.ocp.transcription.transcribe import Parameters, Transcription

TURN = ("cost.calm.expression=body/pitch_rate^2", "cost.calm.weight=2")


def planning(name: str, *changes: str) -> Planning:
    return Planning.of(*load_task(name, list(changes)))


def starts(
    monkeypatch: pytest.MonkeyPatch, solves: Iterator[bool], orders: Iterator[object]
) -> list[str]:
    """Where the plans of a task come from. `solves`: whether each refinement does; `orders`: of
    contacts and valves, as found from each guess."""
    guess = searched(planning("jump.yaml").planner, refused=True)

    def made(planner: Planner, refused: bool, new: Callable[[Plan], bool]) -> Plan | None:
        found = replace(guess, status=Status.ACCEPTABLE)
        return replace(found, refined=next(solves)) if new(found) else None

    monkeypatch.setattr("kemba.ocp.planning.found_and_refined", made)
    monkeypatch.setattr("kemba.ocp.planning.order_of", lambda *known: next(orders))
    return [found.start for found in planning("jump.yaml").plans()]


def test_a_plan_of_a_known_order_is_not_refined_again(monkeypatch: pytest.MonkeyPatch) -> None:
    found = starts(monkeypatch, iter([True] * 4), iter("aaba"))
    assert found == ["guess", "guess 3"]


def test_an_order_that_could_not_be_refined_is_tried_again(monkeypatch: pytest.MonkeyPatch) -> None:
    found = starts(monkeypatch, iter([False, True, True, True]), iter("aaab"))
    assert found == ["guess", "guess 2", "guess 4"]


@pytest.mark.parametrize(
    ("proven", "ended"), [(False, ["guess 2", "guess 3", "guess 4"]), (True, ["guess"])]
)
def test_a_guess_that_gives_no_plan_is_followed_by_others_unless_there_is_none(
    proven: bool, ended: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A flip of two robots had no plan from its first guess, and was given up after 40 s of 300."""
    own = planning("jump.yaml")
    first = searched(own.planner, refused=True)
    reason = Relax("goals.apex", "", "body/z", 0.5, 0.4, "m")
    nothing = replace(first, status=Status.INFEASIBLE, relax=(reason,) if proven else ())
    solves = itertools.chain([nothing], itertools.repeat(replace(first, status=Status.SOLVED)))
    monkeypatch.setattr(Planning, "_from_guess", lambda *known: next(solves))
    assert [found.start for found in own.plans()] == ended


def test_where_no_guess_gives_a_plan_the_last_one_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    own = planning("jump.yaml")
    nothing = replace(searched(own.planner, refused=True), status=Status.LIMIT)
    monkeypatch.setattr(Planning, "_from_guess", lambda *known: nothing)
    assert [(f.start, f.status) for f in own.plans()] == [("guess 4", Status.LIMIT)]


def test_the_order_of_a_plan_is_that_of_its_contacts_and_valves() -> None:
    own = planning("jump.yaml", "nodes=20").planner
    found = searched(own, refused=True)
    known = found.model, found.task, found.requirements
    order = order_of(*known, found.trajectory)
    assert order and order == order_of(*known, found.trajectory)
    valve = found.trajectory["front/valve/extend"].copy()
    valve[3:5] = 1.0 - valve[3:5].round()
    turned = found.trajectory.with_columns({"front/valve/extend [1]": valve})
    assert order_of(*known, turned) != order


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


def test_what_is_only_to_be_as_large_as_possible_moves_no_guess() -> None:
    """A speed at the start without limits gave a guess that was no number, and no end."""
    fastest = "goals.stride={quantity: body/vx, at: start, maximise: true}"
    planner = Planning.of(*load_task("bound.yaml", [fastest])).planner
    known = planner.model, planner.task, planner.requirements
    program = Transcription(*known, whole(planner.model.node), 40)
    assert np.isfinite(planner.guess(program).Y).all()
