"""One leg for all of a robot with more than two: a smaller program whose plans are starts."""

from functools import cache

import numpy as np
import pytest

from kemba.mechanism import Robot, load_robot, robot_mechanism
from kemba.model import Model, load_model
from kemba.ocp import load_task
from kemba.ocp.planner import Planner
from kemba.ocp.task.resolve import resolve
from kemba.ocp.transcription.symmetry import Reduction, equal_legs, find_symmetry, met_alike

LEGS = {
    "front": {"hip": 0.261, "fold": 1},
    "middle": {"hip": 0.05, "fold": 1},
    "rear": {"hip": -0.261, "fold": -1},
}


@cache
def three() -> Model:
    """The planning model on the shipped robot with a third leg."""
    data = load_robot("kemba").model_dump()
    robot = Robot.model_validate({**data, "name": "three", "legs": LEGS})
    return Model(robot_mechanism(robot), load_model("planning").effects, name="three")


def reduction() -> Reduction:
    found = equal_legs(three())
    assert found is not None
    return found


def test_legs_do_the_same_or_its_mirror_image() -> None:
    model, rng = three(), np.random.default_rng(0)
    q = reduction().expand("q", rng.normal(size=reduction().B["q"].shape[1]))
    by_name = dict(zip((c.name for c in model.mechanism.coordinates), q, strict=True))
    assert by_name["body/x"] == by_name["body/pitch"] == 0.0 != by_name["body/z"]
    for joint in ("hip", "knee"):
        first, second, third = (by_name[f"{leg}/{joint}/q"] for leg in LEGS)
        assert first == second == -third != 0.0
    forces = reduction().expand("lam", np.arange(1.0, 1.0 + reduction().B["lam"].shape[1]))
    named = dict(zip(model.forces, forces, strict=True))
    assert named["front", "lam_p"] == named["middle", "lam_p"] == named["rear", "lam_m"]


def test_each_variable_of_the_whole_robot_follows_one() -> None:
    for group, matrix in reduction().B.items():
        assert np.all(np.abs(matrix).sum(axis=1) <= 1), group
        assert np.all(np.abs(matrix).sum(axis=0) >= 1), group
    full = reduction().expand("u", np.arange(3.0)[: reduction().B["u"].shape[1]])
    np.testing.assert_allclose(reduction().expand("u", reduction().restrict("u", full)), full)


def test_what_cannot_change_is_not_asked() -> None:
    task, document = load_task("jump.yaml")
    asked = resolve(task, three(), document)
    kept = {w.quantity.name for w in met_alike(three(), asked, reduction())}
    assert "body/z" in kept and not {"body/x", "body/pitch", "body/vx"} & kept


@pytest.mark.parametrize("name", ["planning", "monoped", "drive_rig"])
def test_robots_of_fewer_legs_have_none(name: str) -> None:
    assert equal_legs(load_model(name)) is None


def test_a_plan_of_three_legs_begins_from_one_leg() -> None:
    """It is a start only: the whole robot's rows are met in the end."""
    model = three()
    assert find_symmetry(model) is None
    task, document = load_task("jump.yaml", ["nodes=40", "height=0.46 m"])
    planner = Planner(task, model, resolve(task, model, document))
    transcription, point = planner.run()
    assert point.solved and not transcription.reduction.symmetric
    names = [str(attempt.name) for attempt in planner.session.attempts]
    assert "relax" in names[0] and any("move switches" in name for name in names), names
