"""Lengths found from feet that stand, and named by `discover`, before any force is blamed."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("numba")

from robot_logs import hops
from twin.catalogue import hidden

from kemba.effects.mechanics.geometry import Geometry
from kemba.identify.adopt import item
from kemba.identify.discover import discover
from kemba.identify.logs.gate import BadData
from kemba.identify.robot import geometry
from kemba.identify.robot.problem import RobotProblem, robot_problem
from kemba.mechanism import robot_mechanism
from kemba.model import Model, load_model
from kemba.model.spec import ModelSpec
from kemba.trajectory import Array, Trajectory

SHORT = {"femur/length": 6.0e-3, "tibia/length": 20e-3, "piston/pin": 1.4e-3}


def unlisted(part: str, seed: int) -> RobotProblem:
    """Hops of the twin under a planning model in whose robot file this part is too short."""
    logs, _ = hops(runs=2, seed=seed, figures_off=0.01)
    planning = load_model("planning")
    short = planning.with_effects([Geometry(part=part, d=-SHORT[part])]).mechanism.need_robot()
    drawn = robot_mechanism(short)
    return robot_problem(logs, Model(drawn, planning.effects, planning.supply, planning.name))


@pytest.mark.parametrize("part", sorted(SHORT))
def test_standing_feet_show_a_wrong_length(part: str) -> None:
    problem = unlisted(part, 3)
    found = problem.lengths.get(f"geometry:{part}.d", 0.0)
    assert found == pytest.approx(SHORT[part], abs=1.5e-3), problem.lengths
    problem.validate()  # a wrong length is to be found; it is not bad data


@pytest.mark.parametrize("k", [12e3, 30e3])
def test_feet_that_sink_into_soft_ground_are_no_fault_of_lengths(k: float) -> None:
    """Under the load of a push or a landing they sink several times as deep as at rest."""
    logs, _ = hops(hidden("ground_compliance", k=k), runs=3, seed=3)
    assert robot_problem(logs, load_model("planning")).lengths == {}


def with_pitch(log: Trajectory, change: Callable[[Array], Array]) -> Trajectory:
    return log.with_columns({"body/pitch [rad]": change(log["body/pitch"])})


def test_a_pitch_of_the_other_sign_is_told_where_it_is_small() -> None:
    """It moves feet by millimetres, and shorter legs would bring them to the ground."""
    (log,), _ = hops(runs=1, seed=12, figures_off=0.01)
    assert np.abs(log["body/pitch"]).max() < 0.07
    problem = robot_problem([with_pitch(log, np.negative)], load_model("planning"))
    assert problem.lengths == {}
    with pytest.raises(BadData, match="hop0: body/pitch has the reversed sign"):
        problem.validate()


@pytest.mark.parametrize("seed", [12, 4])
def test_a_pitch_and_pistons_that_hide_each_other_from_the_feet_are_named(seed: int) -> None:
    """An even hop and one of 45 degrees: feet stand as well as they should, the motion does not."""
    (log,), _ = hops(runs=1, seed=seed, figures_off=0.01)
    front, rear = (f"{leg}/piston/x" for leg in ("front", "rear"))
    crossed = {f"{front} [m]": log[rear], f"{rear} [m]": log[front]}
    mixed = with_pitch(log, np.negative).with_columns(crossed)
    words = "hop0: body/pitch has the reversed sign .* and piston/x of the legs is swapped; the"
    with pytest.raises(BadData, match=words):
        robot_problem([mixed], load_model("planning")).validate()


@pytest.mark.parametrize(
    "change", [lambda p: p, lambda p: p + 0.03, lambda p: p - 0.03, lambda p: 1.1 * p]
)
def test_no_fault_of_the_sensor_is_taken_for_its_sign(change: Callable[[Array], Array]) -> None:
    (log,), _ = hops(runs=1, seed=12, figures_off=0.01)
    problem = robot_problem([with_pitch(log, change)], load_model("planning"))
    assert not problem.mixed
    problem.validate()


@pytest.mark.slow
def test_friction_of_one_leg_is_named_with_its_leg() -> None:
    logs, _ = hops(hidden("seal_friction", 1.2, "front"), runs=2, seed=3, figures_off=0.01)
    problem = robot_problem(logs, load_model("planning"))
    answer = discover(problem).answer
    assert answer.added == ("seal_friction:front",), answer.sentence
    row = item(answer.ranking[0].effect, {"F_c": {"value": 12.0}})
    assert row == {"kind": "seal_friction", "on": "front", "F_c": 12.0}


def test_right_lengths_are_left_alone() -> None:
    logs, _ = hops(runs=2, seed=3, figures_off=0.01)
    assert robot_problem(logs, load_model("planning")).lengths == {}


@pytest.mark.slow
def test_a_long_femur_is_named_and_nothing_else() -> None:
    answer = discover(unlisted("femur/length", 3)).answer
    assert answer.added == ("geometry:femur/length",), answer.sentence
    assert answer.ranking[0].parameters["d"].value == pytest.approx(6.0e-3, abs=1e-3)
    assert answer.error_after < 1.3 < answer.error_before


def test_it_is_written_as_a_model_reads_it() -> None:
    row = item("geometry:tibia/length", {"d": {"value": 0.02}})
    spec = ModelSpec.model_validate({"base": "planning", "effects": [row]})
    assert spec.effects[0] == Geometry(part="tibia/length", d=0.02)


def test_each_zero_is_in_doubt_by_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three lengths, then zeros of the pitch, the height, two hips and two pistons."""
    standing: Any = SimpleNamespace(names=("a", "b", "c"), legs=2)
    width = np.full(9, 1e-4)
    monkeypatch.setattr(
        geometry, "_only", lambda standing, free, x, loose, rows: (0, loose / width > 1.5, 0)
    )
    x, rows = np.zeros(9), np.zeros(0, bool)
    wide = [np.flatnonzero(cost).tolist() for cost in geometry._drawn(standing, x, width, rows)]
    assert wide == [[], [4], [3], [5, 6], [7, 8]]
