"""The half problem: found where model and task are their own mirror image, refused elsewhere."""

import numpy as np
import pytest

from kemba.effects.mechanics.load import ComOffset, Payload
from kemba.effects.pneumatics.valve import Valve
from kemba.mechanism import load_robot, robot_mechanism
from kemba.model import Model, load_model
from kemba.ocp import load_task
from kemba.ocp.task.resolve import resolve
from kemba.ocp.transcription.symmetry import (
    find_symmetry,
    mirrored_requirements,
    requirements_are_symmetric,
)


@pytest.fixture(scope="module")
def planning() -> Model:
    return load_model()


def test_the_planning_model_is_symmetric(planning: Model) -> None:
    half = find_symmetry(planning)
    assert half is not None and half.symmetric
    sizes = {name: matrix.shape for name, matrix in half.B.items()}
    assert sizes == {"q": (7, 3), "s": (4, 2), "lam": (12, 6), "u": (6, 3)}
    assert (len(half.rate), len(half.pairs), len(half.limits)) == (2, 6, 2)


def test_half_and_full_values_convert_exactly(planning: Model) -> None:
    half = find_symmetry(planning)
    assert half is not None
    for group, matrix in half.B.items():
        values = np.random.default_rng(0).normal(size=(5, matrix.shape[1]))
        assert half.restrict(group, half.expand(group, values)) == pytest.approx(values)


def test_a_payload_in_the_middle_keeps_it(planning: Model) -> None:
    assert find_symmetry(planning.with_effects([Payload(m=0.7)])) is not None


def test_an_effect_on_one_leg_refuses_it(planning: Model) -> None:
    others = [e for e in planning.effects if e.kind != "end_stop"]
    stops = planning.effect("end_stop")
    one_leg = Model(planning.mechanism, [*others, stops.model_copy(update={"on": "rear"})])
    assert find_symmetry(one_leg) is None


def test_unlike_legs_refuse_it(planning: Model) -> None:
    """Both legs have valves, but the legs' chambers differ: only the residual tells."""
    rest = [e for e in planning.effects if e.kind != "chamber"]
    chamber = planning.effect("chamber")
    front = chamber.model_copy(update={"on": "front"})
    rear = chamber.model_copy(update={"on": "rear", "F_extend": (280.0, 300.0, 340.0)})
    assert find_symmetry(Model(planning.mechanism, [*rest, front, rear])) is None
    same = chamber.model_copy(update={"on": "rear"})
    assert find_symmetry(Model(planning.mechanism, [*rest, front, same])) is not None


def test_a_lopsided_body_refuses_it(planning: Model) -> None:
    assert find_symmetry(planning.with_effects([ComOffset(d=0.01)])) is None


@pytest.mark.parametrize(
    "rear", [{"hip": -0.2, "fold": -1}, {"hip": -0.261, "fold": 1}], ids=["hip", "fold"]
)
def test_an_asymmetric_robot_has_none(planning: Model, rear: dict[str, float]) -> None:
    data = load_robot("kemba").model_dump()
    data["legs"]["rear"] = rear
    robot = type(load_robot("kemba")).model_validate(data)
    assert find_symmetry(Model(robot_mechanism(robot), planning.effects)) is None


@pytest.mark.parametrize(
    ("override", "symmetric"),
    [
        ("nodes=50", True),
        ("end={body/x: 0.1 m}", False),
        ("end={body/pitch: 5 deg}", False),
        ("bounds={front/piston/x: {at_most: 5 cm}}", False),
        ("bounds={front/hip/q: {at_least: -1}}", False),
        ("bounds={front/hip/q: {at_least: -1}, rear/hip/q: {at_most: 1}}", True),
        ("bounds={'*/piston/x': {at_most: 5 cm}}", True),
    ],
)
def test_tasks(planning: Model, override: str, symmetric: bool) -> None:
    task, document = load_task("jump.yaml", [override])
    assert requirements_are_symmetric(planning, resolve(task, planning, document)) is symmetric


def test_equal_requirements_of_both_legs(planning: Model) -> None:
    """Of a jump ahead all but the way ahead, with hips at odds with each other not theirs."""
    hips = "start={front/hip/q: -1.1, rear/hip/q: 1.2, body/x: 0 m}"
    task, document = load_task("jump_forward.yaml", [hips])
    requirements = resolve(task, planning, document)
    alike = mirrored_requirements(planning, requirements)
    left_out = {(w.quantity.name, w.at) for w in requirements} - {
        (w.quantity.name, w.at) for w in alike
    }
    assert left_out == {("body/x", 1.0), ("front/hip/q", 0.0), ("rear/hip/q", 0.0)}


def test_valves_alone_have_no_mirror_without_a_robot() -> None:
    from kemba.mechanism import load_cylinder, rig_mechanism

    assert find_symmetry(Model(rig_mechanism(load_cylinder("dsnu-25-70")), [Valve()])) is None
