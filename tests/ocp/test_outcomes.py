"""What solving answers when it fails, is repeated, or is asked to use only half the robot."""

import math
import time
from dataclasses import replace

import numpy as np
import pytest
from ocp.runs import solved

from kemba.model import load_model
from kemba.ocp import load_task, plan
from kemba.ocp.certificate.asked import MeasuredRequirement
from kemba.ocp.certificate.certify import Certificate, certify
from kemba.ocp.certificate.status import law, reached
from kemba.ocp.planner import Planner
from kemba.ocp.relaxation.schedule import find, fix, tighten
from kemba.ocp.task.resolve import resolve
from kemba.ocp.transcription.solution import to_trajectory
from kemba.ocp.transcription.symmetry import find_symmetry
from kemba.trajectory import Trajectory

FILES = [
    "certificate.json",
    "controller.csv",
    "controller.meta.yaml",
    "manifest.json",
    "solver.log",
    "task.yaml",
    "trajectory.csv",
    "trajectory.meta.yaml",
]


def test_a_failed_solve_writes_the_same_files() -> None:
    failed = solved("jump", "solver.max_iterations=3")
    for run in (failed, solved("jump")):
        assert sorted(path.name for path in run.run.path.iterdir()) == FILES
    answer = failed.run.certificate
    assert failed.exit_code == 1
    assert answer["status"] == failed.run.manifest["status"] == "limit"
    assert answer["sentence"].startswith("FAILED: a limit came before a plan was found: worst: ")


def test_the_worst_violation_is_named() -> None:
    failed = solved("jump", "solver.max_iterations=3")
    worst = failed.run.certificate["worst"]
    assert 1 <= len(worst) <= 8
    first = worst[0]
    assert set(first) == {"what", "node", "time_s", "violation", "unit"}
    assert first["violation"] > 0 and first["unit"]
    plan = failed.plan
    assert plan.time[first["node"]] == pytest.approx(first["time_s"])
    named = f"worst: {law(first['what'])}, off by {first['violation']:.3g} {first['unit']}"
    assert named in failed.run.certificate["sentence"]


@pytest.mark.parametrize(
    ("what", "words"),
    [
        ("dynamics:front/hip/q", "the equation of motion of front/hip/q"),
        ("rear/contact:slip forward", "slip forward of rear/contact"),
        ("front/motor:speed_forward", "speed forward of front/motor"),
        ("start.*/foot/z:front/foot/z", "`start.*/foot/z` on front/foot/z"),
        ("landing.impact_speed", "`landing.impact_speed`"),
        ("goals.apex:body/z", "`goals.apex` on body/z"),
    ],
)
def test_rows_have_words(what: str, words: str) -> None:
    assert law(what) == words


def test_building_and_solving_take_different_seconds() -> None:
    started = time.perf_counter()
    found = plan(load_task("jump", ["nodes=20", "refine=none", "solver.max_iterations=5"])[0])
    assert 0.0 < found.build_s < found.build_s + found.solve_s < time.perf_counter() - started


def test_a_time_limit_keeps_the_best_iterate() -> None:
    stopped = solved("jump", "solver.time_limit=0.3 s")
    assert stopped.run.certificate["status"] == "limit"
    assert np.isfinite(stopped.plan["body/z"]).all()


def test_an_impossible_jump_is_not_solved() -> None:
    answer = solved("jump", "height=1.6 m", "solver.max_iterations=150", nodes=24).run.certificate
    assert answer["status"] in ("infeasible", "limit", "stalled")
    assert answer["worst"]


def test_the_same_task_gives_the_same_plan() -> None:
    task, document = load_task("max_jump.yaml", ["nodes=24", "refine=none"])
    first, second = plan(task, document), plan(task, document)
    assert first.status == "solved"
    assert first.trajectory.names == second.trajectory.names
    for name in first.trajectory.names:
        assert np.array_equal(first.trajectory[name], second.trajectory[name]), name
    assert first.sentence == second.sentence
    assert first.cost == second.cost


def test_half_a_plan_is_a_whole_one() -> None:
    """The half problem's solution, widened, has the whole model's residuals within tolerance."""
    task, document = load_task("max_jump.yaml", ["nodes=24"])
    model = load_model(task.model, supply=task.supply)
    requirements = resolve(task, model, document)
    half = find_symmetry(model)
    assert half is not None
    planner = Planner(task, model, requirements)
    schedule = planner.schedule(task.nodes, half)
    transcription = schedule.transcription
    point = find(schedule, planner.guess(transcription))
    point = tighten(schedule, fix(schedule, point))
    assert point.solved
    found = certify(model, task, requirements, to_trajectory(transcription, point.Y))
    assert found.within(task.tolerances), found.worst


def test_every_iteration_is_watched_and_every_stage_told() -> None:
    task, document = load_task("max_jump.yaml", ["nodes=24", "solver.max_iterations=5"])
    seen: list[tuple[int, float, float]] = []
    told: list[str] = []
    plan(task, document, tell=told.append, watch=lambda *values: seen.append(values))
    assert told[0] == "relax (half robot, 24 nodes)"
    assert seen[0][0] == 0 and all(math.isfinite(x) for values in seen for x in values)


def test_the_papers_method_runs() -> None:
    """One penalty solve (eq. 9) answers in the same form: its status is what is measured on the
    trajectory that it left, solved or not."""
    found = solved("max_jump", "method=penalty", "solver.time_limit=20 s", nodes=24)
    answer, measured = found.run.certificate, found.measured
    assert [a["name"] for a in answer["attempts"]] == ["penalty, rho = 10000"]
    assert answer["iterations"] > 0 and np.isfinite(found.plan["body/z"]).all()
    residuals = {name: getattr(measured, name) for name in answer["residuals"]}
    assert answer["residuals"] == pytest.approx(residuals, rel=1e-6, abs=1e-12)
    assert (answer["status"] == "solved") == measured.within(found.task.tolerances)
    assert found.exit_code == (0 if answer["status"] == "solved" else 1)
    assert measured.dynamics < 1e-3, "the equations of motion hold, whatever the pairs do"


def test_a_sentence_tells_all_that_a_motion_reaches() -> None:
    """How far, how fast at the end, and goals beside the height; what stays as it was is not."""
    goal = MeasuredRequirement("", "goals.apart:gap", 0.25, 0.2, np.inf, "m", 0.0, 1.0, 0, 0.0)
    asked = (goal, replace(goal, text="goals.apex:body/z"), replace(goal, text="end.rest:body/vx"))
    found = Certificate(0.0, 0.0, 0.0, 0.0, (), asked)
    rows = {
        "body/z [m]": [0.3, 0.5],
        "body/x [m]": [1.0, 0.7],
        "body/vx [m.s-1]": [0.0, -1.5],
        "body/pitch [rad]": [0.0, 2 * np.pi],
        "body/pitch_rate [rad.s-1]": [0.0, 3.5],
    }
    plan = Trajectory(np.array([0.0, 0.6]), {key: np.array(at) for key, at in rows.items()})
    assert reached(found, plan) == [
        "apex 0.500 m", "0.30 m back", "turned by 360 deg", "-1.50 m/s at the end",
        "turning at 3.50 rad/s at the end", "apart 0.25 m", "0.600 s",
    ]  # fmt: skip
    still = Trajectory(plan.time, {key: np.array(at)[[0, 0]] for key, at in rows.items()})
    assert reached(replace(found, asked=()), still) == ["apex 0.300 m", "0.600 s"]
