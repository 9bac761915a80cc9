"""Walls and obstacles as sides of the guess's course, on level ground that changes its height."""

from dataclasses import replace

import numpy as np
import pytest

from kemba.ocp.certificate.status import Status
from kemba.ocp.planned import Plan, judge
from kemba.ocp.planner import Planner
from kemba.ocp.planning import Planning, StartGuess, guesses, plan
from kemba.ocp.reading import load_task
from kemba.ocp.relaxation.guess import automatic_guess
from kemba.ocp.sides import GuessedCourse, on_level_ground, runs
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.transcription.level import GroundRise, ground_after, ground_at_nodes
from kemba.ocp.transcription.solution import to_trajectory
from kemba.ocp.transcription.symmetry import whole
from kemba.ocp.transcription.transcribe import Transcription

LOW = "terrain=[{height: 0.1 m}, {from: 0.235 m, height: 0 m}]"
HALF = "terrain=[{from: 0 m, height: 0.05 m}]"  # between the legs


def planner(task: str, *settings: str) -> Planner:
    return Planning.of(*load_task(task, [*settings])).planner


def level(task: str, *settings: str) -> Planner:
    found = on_level_ground(planner(task, *settings).seeking)
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("task", "heights"),
    [("platform.yaml", [0.15]), ("drop_off.yaml", [-0.3]), ("hurdle.yaml", [])],
)
def test_the_ground_rises_while_all_feet_fly(task: str, heights: list[float]) -> None:
    course = GuessedCourse(planner(task).seeking)
    assert [rise.height for rise in course.rises] == pytest.approx(heights)
    assert course.flies
    ground = level(task).model.mechanism.scene.ground
    assert ground.level == pytest.approx(0.3 if task == "drop_off.yaml" else 0.0)


@pytest.mark.parametrize(
    ("task", "settings"),
    [
        ("jump.yaml", ""),
        ("jump_forward.yaml", "terrain=[{from: 0.2 m, slope: 5 deg}]"),
        ("jump.yaml", HALF),  # a foot stands on either height
        ("jump_forward.yaml", HALF),
    ],
)
def test_there_is_nothing_to_level(task: str, settings: str) -> None:
    assert on_level_ground(planner(task, *filter(None, [settings]))) is None


def rises(r: Requirement) -> bool:
    return r.quantity.name.endswith("/z")


def test_a_foot_is_in_front_of_a_wall_then_over_it_and_both_in_between() -> None:
    """In the flight; where it stands it keeps to its own ground."""
    found, scene = level("platform.yaml"), planner("platform.yaml")
    known = {r.label for r in scene.requirements}
    of_foot = [
        r for r in found.requirements
        if r.quantity.name.startswith("rear/foot") and r.label not in known
    ]  # fmt: skip
    of_wall = [r for r in of_foot if r.text == "terrain"]
    front, over = (next(r for r in of_wall if ask(r)) for ask in (lambda r: r.upper < 0.3, rises))
    assert front.during[1] == over.during[0]
    stand = [r for r in of_wall if r.lower > 0.3]
    assert stand and all(r.during[0] > found.rises[0].share for r in stand)


def test_no_point_gets_through_an_obstacle_between_two_nodes() -> None:
    """Over it at two nodes at least, at each end of which it is in front of it or behind it, too;
    legs are as long as they are."""
    found = level("hurdle.yaml")
    for point in ("front/foot", "rear/foot", "front/knee", "rear/knee"):
        own = [r for r in found.requirements if r.text == "obstacles[0]" and point in r.label]
        front, over, behind = sorted(own, key=lambda r: r.during)
        assert front.during[1] == over.during[0] < over.during[1] == behind.during[0]
        assert over.lower == pytest.approx(0.2, abs=5e-3)
    course = GuessedCourse(planner("hurdle.yaml").seeking)
    for leg in ("front", "rear"):
        assert (course.places[f"{leg}/foot"][1] < course.places[f"{leg}/hip"][1]).all()


def test_heights_count_from_the_ground_of_their_node() -> None:
    """Those of the body, and the difference of two moments."""
    asks = ["end.body/z={at_least: 0.3 m}", "bounds.body/z={at_most: 0.9 m}"]
    asks.append("goals={up: {quantity: 'at(end, body/z) - at(start, body/z)', at_least: 0.1 m}}")
    found = level("platform.yaml", *asks)
    asked = [r for r in found.requirements if r.quantity.name == "body/z"]
    ends = {r.text: (r.lower, r.upper) for r in asked}
    assert ends["end.body/z"][0] == pytest.approx(0.15)
    assert ends["goals.up"][0] == pytest.approx(-0.05)
    bounds = [r for r in asked if r.text == "bounds.body/z"]
    assert [r.upper for r in bounds] == pytest.approx([0.9, 0.75])
    assert not set(bounds[0].nodes(100)) & set(bounds[1].nodes(100))


def test_the_ground_after_several_rises() -> None:
    rises = (GroundRise(0.2, 0.1), GroundRise(0.6, -0.3))
    assert [ground_after(rises, at) for at in (0.19, 0.2, 0.6)] == pytest.approx([0, 0.1, -0.2])
    assert ground_at_nodes(rises, 5) == pytest.approx([0, 0.1, 0.1, -0.2, -0.2, -0.2])
    assert [*runs("aab")] == [("a", 0, 1), ("b", 2, 2)]


def test_a_motion_fulfils_the_level_program_as_that_of_its_scene() -> None:
    """The same rows of kinematics and motion, for feet off the walls."""
    low, own = level("platform.yaml", "nodes=50"), planner("platform.yaml", "nodes=50").seeking
    known = whole(own.model.node), 50
    there = Transcription(own.model, own.task, own.requirements, *known)
    here = Transcription(low.model, low.task, low.requirements, *known, low.rises)
    Y = automatic_guess(own.model, own.task, own.requirements, there.layout, 50)
    assert here.raised(here.raised(Y, -1.0)) == pytest.approx(Y)

    def defects(program: Transcription, Y: np.ndarray) -> np.ndarray:
        g = np.array(program.problem.g(Y.ravel(), np.full(5, 0.1))).ravel() - program.g_lower
        kinds = [(m.kind, m.label) for m in program.meanings]
        rows = [i for i, (kind, label) in enumerate(kinds) if kind == "defect"]
        return g[rows]

    assert defects(here, here.raised(Y, -1.0)) == pytest.approx(defects(there, Y), abs=1e-9)
    plan = to_trajectory(here, here.raised(Y, -1.0), own.model)
    assert plan["front/foot/gap"] == pytest.approx(to_trajectory(there, Y)["front/foot/gap"])


def test_what_is_asked_of_the_scene_by_an_expression_needs_the_scene() -> None:
    found = planner("platform.yaml").seeking
    first = found.requirements[0]
    named = replace(first.quantity, name="front/foot/z - rear/foot/z")
    asked: list[Requirement] = [replace(first, quantity=named)]
    assert on_level_ground(replace(found, requirements=[*found.requirements, *asked])) is None


@pytest.mark.parametrize("found", [False, True])
def test_every_guess_is_followed_on_level_ground_and_one_in_the_scene(
    found: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where none gives a plan, that in the scene says why."""
    made: list[StartGuess] = []
    planning = Planning.of(*load_task("platform.yaml"))
    old = planning.planner.refuse()

    def from_guess(self: Planning, guess: StartGuess, new: object) -> Plan:
        made.append(guess)
        none = judge(self.planner.model, self.planner.requirements, *old)
        return replace(none, status=Status.SOLVED) if found and guess.level else none

    monkeypatch.setattr(Planning, "_from_guess", from_guess)
    plans = [*planning.plans()]
    assert [guess.level for guess in made] == [True] * (len(made) - 1) + [False]
    assert len(plans) == (len(made) if found else 1)
    assert plans[-1].start == f"guess {len(made)}"


def test_without_walls_no_guess_is_on_level_ground() -> None:
    own = planner("jump_forward.yaml")
    assert not any(guess.level for guess in guesses(own.task, own.model))


@pytest.mark.slow
def test_a_jump_off_a_platform_is_found() -> None:
    """On nodes, from a guess; its certificate is that of the scene."""
    found = plan(*load_task("drop_off.yaml", ["refine=none", "model=planning", LOW]))
    assert found.status.plan, found.sentence
    assert found.trajectory["rear/foot/z"][0] == pytest.approx(0.1, abs=1e-5)
    assert found.trajectory["rear/foot/z"][-1] == pytest.approx(0.0, abs=1e-5)
    assert found.certificate.within(found.task.tolerances)
