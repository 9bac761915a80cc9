"""Why not: every impossible task ends with exit 1 and names a true culprit."""

import json
import time
from pathlib import Path
from typing import Any

import pytest
from ocp.impossible import REFUSED, SEARCHED, SWING, Impossible
from typer.testing import CliRunner

from kemba.config import find_config
from kemba.ocp import Task, load_task, task_model
from kemba.ocp.infeasibility.checks import air_work, check_task, inertia_and_weight
from kemba.ocp.infeasibility.explain import Diagnostic, Relax
from kemba.ocp.task.resolve import resolve
from kemba_cli.main import app

SHIPPED = ("jump", "hop", "jump_forward", "max_jump", "drop", "stand")


def solved(case: Impossible, folder: Path) -> tuple[int, dict[str, Any]]:
    """Exit code and JSON answer of `kemba-opt solve`."""
    arguments = ["solve", case.task, "--json", "--no-figure", "--out", str(folder / "run")]
    for option in case.options:
        arguments += ["--set", option]
    if case.model:
        (folder / "model.yaml").write_text(case.model)
        arguments += ["--model", str(folder / "model.yaml")]
    done = CliRunner().invoke(app, arguments)
    return done.exit_code, json.loads(done.stdout)


def holds(case: Impossible, exit_code: int, answer: dict[str, Any]) -> None:
    """The answer is a refusal that names the culprit."""
    assert (exit_code, answer["status"]) == (1, "infeasible")
    for words in case.named:
        assert words in answer["sentence"]
    assert answer["sentence"].startswith("FAILED: cannot be met: ")
    requirements = [r["requirement"] for r in answer["relax"]]
    assert case.relax in requirements if case.relax else not requirements
    for r in answer["relax"]:
        assert r["asked"] != r["reachable"] and r["where"]


@pytest.mark.parametrize("case", REFUSED, ids=lambda case: case.name)
def test_refused_without_solving(case: Impossible, tmp_path: Path) -> None:
    exit_code, answer = solved(case, tmp_path)
    holds(case, exit_code, answer)
    assert answer["iterations"] == 0
    assert not (tmp_path / "run" / "trajectory.csv").exists()
    assert not (tmp_path / "run" / "controller.csv").exists()


@pytest.mark.parametrize("case", SEARCHED, ids=lambda case: case.name)
def test_explained_after_solving(case: Impossible, tmp_path: Path) -> None:
    before = time.process_time()
    exit_code, answer = solved(case, tmp_path)
    assert time.process_time() - before < 60
    holds(case, exit_code, answer)
    written = json.loads((tmp_path / "run" / "certificate.json").read_text())
    assert written["relax"] == answer["relax"]


def test_the_apex_within_reach_is_told(tmp_path: Path) -> None:
    case = SEARCHED[0]
    _, answer = solved(case, tmp_path)
    (apex,) = answer["relax"]
    assert apex["asked"] == pytest.approx(1.45)
    assert 1.0 < apex["reachable"] < 1.4
    assert "front and rear extension valves are open throughout the push" in answer["sentence"]
    lines = find_config("jump.yaml", "tasks").read_text("utf-8").splitlines()
    line = next(i for i, text in enumerate(lines, 1) if text.startswith("  apex:"))
    assert apex["where"].endswith(f"jump.yaml:{line}:3")
    assert answer["iterations"] < 2000


def diagnostics(name: str, *options: str) -> list[Diagnostic]:
    """What the checks say before solving."""
    task, document = load_task(name, list(options))
    model = task_model(task)
    return check_task(task, model, resolve(task, model, document), document)


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_tasks_pass_the_checks(name: str) -> None:
    assert not [f for f in diagnostics(name) if f.certain]


@pytest.mark.parametrize(
    "options",
    [
        ("height=0.9 m", "payload=1 kg", "supply=0.6 MPa"),
        ("height=0.9 m", "supply=0.8 MPa"),
        ("height=0.35 m", "payload=1 kg"),
        ("nodes=24",),
        SWING,
        ("bounds.*/valve/retract=0",),
    ],
    ids=str,
)
def test_checks_are_generous(options: tuple[str, ...]) -> None:
    assert not [f for f in diagnostics("jump", *options) if f.certain]


def test_checks_take_no_time() -> None:
    task, document = load_task("jump")
    model = task_model(task)
    requirements = resolve(task, model, document)
    assert model.node
    before = time.process_time()
    check_task(task, model, requirements, document)
    assert time.process_time() - before < 1.0


def test_air_work_is_force_times_stroke() -> None:
    assert air_work(task_model(Task(supply="0.7 MPa"))) == pytest.approx(2 * 324 * 0.07, rel=1e-3)
    assert air_work(task_model(Task(supply="0.6 MPa"))) == pytest.approx(2 * 287 * 0.07, rel=1e-3)


def test_free_fall_counts_boom_and_payload() -> None:
    mass, weight = inertia_and_weight(task_model(Task()))
    assert weight / mass == pytest.approx(10.7, abs=0.05)
    heavier = inertia_and_weight(task_model(Task(payload="2 kg")))
    assert heavier[0] - mass == pytest.approx(2.0)
    assert heavier[1] - weight == pytest.approx(2 * 9.81)


def test_a_value_outside_its_range_is_told() -> None:
    (found,) = diagnostics("jump", "end.body/z=4 m", "bounds={}")
    assert found.certain and "3 m is the most" in found.sentence
    assert "body/z stays within 0 m to 3 m" in found.sentence


def test_two_requirements_on_rates_that_exclude_each_other() -> None:
    (found,) = diagnostics("jump", "start.body/vz=1 m/s")
    assert found.certain and "`start.rest`" in found.sentence
    assert "`start.body/vz`" in found.sentence


def test_poses_that_a_chain_cannot_hold() -> None:
    """Feet on the ground, pistons retracted, body level: the knees cannot be straight too."""
    (found,) = diagnostics("jump", "start.front/knee/q=50 deg")
    assert found.certain and found.relax and "no pose" in found.sentence


def test_a_pose_with_more_equalities_than_variables_prints_nothing(
    capfd: pytest.CaptureFixture[str],
) -> None:
    (found,) = diagnostics("jump_forward", "start.body/z=30 cm", "start.*/hip/q=0.5 rad")
    assert found.certain and "no pose" in found.sentence
    assert capfd.readouterr() == ("", ""), "CasADi warns of such programs by itself"


def test_small_gaps_are_told_with_digits_enough() -> None:
    gap = Relax("start.*/piston/x", "", "front/piston/x", 0.0, 2.4e-5, "m")
    assert str(gap).startswith("`start.*/piston/x`: 0 m asked, 2e-05 m is the least")
    assert gap.placed() == str(gap), "a task without a file has no place to name"
