"""The course of a start guess: where feet are between their stances."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from kemba.model import Model
from kemba.ocp import load_task
from kemba.ocp.reading import asked_of
from kemba.ocp.relaxation import guess
from kemba.ocp.relaxation.guess import LIFT, Course, in_order
from kemba.ocp.task.task import Task
from kemba.scene.scene import AROUND

STANCES = (
    "{on: [front, rear], share: 35 %}, {on: air, share: 35 %}, {on: [front, rear], share: 30 %}"
)


def course_of(*words: str) -> tuple[Task, Model, Course]:
    """A jump of 0.6 m ahead, at 81 moments."""
    task, document = load_task(
        "jump_forward.yaml", [f"contacts=[{STANCES}]", "distance=0.6 m", "folding=false", *words]
    )
    model, asked = asked_of(task, document)
    moments = np.linspace(0.0, task.duration, 81)
    return task, model, in_order(model, task, asked, moments, (0.2, 0.4))


def foot(*words: str) -> tuple[Task, np.ndarray]:
    """Places of the front foot (n, 2)."""
    task, model, course = course_of(*words)
    hip = next(iter(model.mechanism.need_robot().legs.values())).hip
    hips = np.column_stack([course.x + hip * np.cos(course.pitch), course.z])
    return task, hips + course.feet["front"]


def test_on_level_ground_a_foot_swings_evenly() -> None:
    _, places = foot()
    assert np.allclose(places[:, 1].max(), LIFT, atol=1e-3)
    moving = np.abs(np.diff(places[:, 0])) > 1e-9
    assert np.ptp(np.diff(places[:, 0])[moving][1:-1]) < 1e-9


@pytest.mark.parametrize(
    "words",
    [
        ("terrain=[{from: 0.28 m, height: 0.15 m}]",),
        ("obstacles=[{from: 0.45 m, to: 0.5 m, height: 0.2 m}]",),
        ("terrain=[{from: 0.5 m, height: -0.2 m}]",),
    ],
)
def test_a_foot_swings_over_what_stands_between(words: tuple[str, ...]) -> None:
    """And as far as the leg folds, 3 cm over an obstacle; never on the other side of its hip."""
    task, places = foot(*words)
    folded = course_of(*words)[2].feet["front"][:, 1] >= -0.2 - 1e-9
    above = places[:, 1] - task.scene.skyline(places[:, 0])
    assert above[~folded].min() > -5e-3  # it is looked at 19 shares of the swing
    assert above.min() > -AROUND
    assert above.max() < 0.4


@pytest.mark.parametrize("wall", ["0.15 m", "-0.2 m"])
def test_the_body_flies_on_one_parabola_over_a_wall(wall: str) -> None:
    task, _, course = course_of(f"terrain=[{{from: 0.28 m, height: {wall}}}]")
    step = task.duration / 80
    falls = np.diff(course.z, 2)[29:55] / step**2  # 35 % to 70 % of the motion
    assert falls == pytest.approx(np.full(len(falls), -9.81), rel=1e-3)


def test_a_foot_stands_where_it_is_asked_to() -> None:
    """Its hip is beyond the edge from which the robot is to jump."""
    words = ("start.front/foot/x={at_most: 0.23 m}", "terrain=[{from: 0.235 m, height: -0.2 m}]")
    _, places = foot(*words)
    assert places[0] == pytest.approx([0.23, 0.0], abs=1e-9)


def test_the_body_goes_ahead_from_the_end_of_its_first_stance(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """To a speed of 1 m/s at the end, evenly: a triangle of speed over 0.5 s."""
    monkeypatch.setattr(guess, "_from_to", lambda *_: (0.3, 0.0))
    speed: Any = SimpleNamespace(
        at=1.0, lower=1.0, upper=1.0, minus=None, location=("end",),
        quantity=SimpleNamespace(name="body/vx"),
    )  # fmt: skip
    t = np.linspace(0.0, 0.7, 701)
    x = guess._ahead([speed], [(0.0, 0.2), (0.2, 0.5), (0.5, 0.7)], [False, True, True], t)
    assert x[t <= 0.2] == pytest.approx(0.3)
    assert x[-1] == pytest.approx(0.3 + 0.25)
