"""`kemba-opt solve`, as scripts see it: streams, exit codes, JSON, and what mistakes are told."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from kemba.ocp import load_task, task_model
from kemba.runs import load_run
from kemba.trajectory import Trajectory
from kemba_cli.main import app

COARSE = ("--set", "nodes=24")
# plans as coarse as this solve as implicit Euler, but are not refined and do not come true
PLAIN = (*COARSE, "--no-replay", "--set", "refine=none")

BAD_KEYS = """\
name: mine
height: 5 kg
hieght: 0.4 m
nodes: many
start:
  rest: true
goals:
  apex: {quantity: body/z, at: midle, equals: height}
solver: {time_limt: 3 s}
method: penlty
"""

BAD_KEYS_TOLD = """\
mine.yaml:2:1: height: '5 kg' is a mass; a length such as '0.5 m' was expected
    height: 5 kg
    ^
mine.yaml:3:1: hieght: unknown key; did you mean 'height'?
    hieght: 0.4 m
    ^
mine.yaml:4:1: nodes: 'many' is of the wrong kind; a whole number was expected
    nodes: many
    ^
mine.yaml:9:10: solver.time_limt: unknown key; did you mean 'time_limit'?
    solver: {time_limt: 3 s}
             ^
mine.yaml:10:1: method: 'penlty' is not allowed; did you mean 'penalty'?
    method: penlty
    ^
mine.yaml:8:28: goals.apex: no moment 'midle'; did you mean 'middle'?
      apex: {quantity: body/z, at: midle, equals: height}
                               ^
"""

BAD_NAMES = """\
name: mine
start:
  rest: 1 m
  body/pitch: 3 kg
  "*/fot/z": 0 m
end:
  body/x: distance
bounds:
  body/z: {at_least: 1 m, at_most: 50 cm}
  front/piston/x: {}
goals:
  apex: {quantity: body/zz, at: middle, equals: 0.4 m}
cost:
  torque_sqared: 1
  air: 2
solver:
  options: {tolx: 1e-3, max_iter: many, linear_solver: ma97}
"""

BAD_NAMES_TOLD = """\
mine.yaml:3:3: start.rest: 'rest' is either true or left out
      rest: 1 m
      ^
mine.yaml:4:3: start.body/pitch: '3 kg' is a mass; an angle such as '30 deg' was expected
      body/pitch: 3 kg
      ^
mine.yaml:5:3: start.*/fot/z: unknown quantity '*/fot/z'; did you mean 'rear/foot/z'?
      "*/fot/z": 0 m
      ^
mine.yaml:7:3: end.body/x: refers to 'distance', which the task does not give
      body/x: distance
      ^
mine.yaml:9:3: bounds.body/z: at_least 1 is above at_most 0.5 m
      body/z: {at_least: 1 m, at_most: 50 cm}
      ^
mine.yaml:10:3: bounds.front/piston/x: asks for nothing; 'equals', 'at_least' or 'at_most' was \
expected
      front/piston/x: {}
      ^
mine.yaml:12:10: goals.apex.quantity: unknown quantity 'body/zz'; did you mean 'body/z'?
      apex: {quantity: body/zz, at: middle, equals: 0.4 m}
             ^
mine.yaml:14:3: cost: unknown cost 'torque_sqared'; did you mean 'torque_squared'?
      torque_sqared: 1
      ^
mine.yaml:17:13: solver.options: unknown option 'tolx'; did you mean 'tol'?
      options: {tolx: 1e-3, max_iter: many, linear_solver: ma97}
                ^
mine.yaml:17:25: solver.options.max_iter: 'many' is not an integer; 0 <= max_iter
      options: {tolx: 1e-3, max_iter: many, linear_solver: ma97}
                            ^
mine.yaml:17:41: solver.options.linear_solver: 'ma97' is not in the installed IPOPT; one of: \
mumps, spral
      options: {tolx: 1e-3, max_iter: many, linear_solver: ma97}
                                            ^
"""


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def run(*words: str) -> Result:
    return CliRunner().invoke(app, ["solve", *words])


def answer(done: Result) -> dict[str, Any]:
    """The one JSON object on stdout."""
    found = json.loads(done.stdout)
    assert isinstance(found, dict)
    return found


@pytest.mark.parametrize(("text", "told"), [(BAD_KEYS, BAD_KEYS_TOLD), (BAD_NAMES, BAD_NAMES_TOLD)])
def test_all_mistakes_of_a_task_are_told_at_once(text: str, told: str) -> None:
    Path("mine.yaml").write_text(text)
    done = run("mine.yaml")
    assert (done.exit_code, done.stdout, done.stderr) == (2, "", told)
    assert not Path("runs").exists()


def test_check_tells_the_same_mistakes() -> None:
    Path("mine.yaml").write_text(BAD_NAMES)
    done = CliRunner().invoke(app, ["check", "mine.yaml", "jump.yaml"])
    assert (done.exit_code, done.stderr) == (2, BAD_NAMES_TOLD)
    assert done.stdout == "jump.yaml: valid task file\n"


@pytest.mark.parametrize(
    ("option", "told"),
    [
        ("nods=3", "nods: unknown key; did you mean 'nodes'?"),
        ("nodes=2", "nodes: '2' is out of range; at least 4 was expected"),
        ("height=2 kg", "height: '2 kg' is a mass; a length such as '0.5 m' was expected"),
        ("supply=0.9 bar", "supply: '0.9 bar' is out of range; at least 101325 Pa was expected"),
        ("goals.apx.equals=1", "goals.apx.quantity: missing; this file needs it"),
        ("cost.torque=1", "cost: unknown cost 'torque'; did you mean 'torque_squared'?"),
        ("solver.options.tool=1", "solver.options: unknown option 'tool'; did you mean 'tol'?"),
        (
            "solver.options.bound_mult_init_method=least",
            "solver.options.bound_mult_init_method: IPOPT does not accept 'least'; one of: "
            "constant, mu-based",
        ),
        ("solver.options.tol=-1", "solver.options.tol: IPOPT does not accept '-1'; 0 < tol"),
        (
            "solver.complementarity=1e-9",
            "solver.complementarity: '1e-09' is out of range; 1e-07 to 0.001 was expected",
        ),
        (
            "min_dwell=1 s",
            "min_dwell: 1 s is not less than the motion's 0.7 s, so that no valve could open and "
            "close again; give less than 0.7 s",
        ),
        (
            "goals.apex.quantity=body/y",
            "goals.apex.quantity: unknown quantity 'body/y'; did you mean 'body/z'?",
        ),
    ],
)
def test_a_mistake_on_the_command_line_is_told_with_its_option(option: str, told: str) -> None:
    done = run("jump.yaml", "--set", option)
    assert (done.exit_code, done.stderr) == (2, f"--set {option}: {told}\n")


def test_a_task_that_is_not_there() -> None:
    done = run("jmp.yaml")
    assert (done.exit_code, done.stderr) == (
        2,
        "jmp.yaml: no such file; a YAML file, of your own or shipped, was expected; "
        "did you mean 'jump.yaml'?\n",
    )


def test_json_is_one_object_with_the_promised_keys() -> None:
    done = run("max_jump.yaml", *PLAIN, "--out", "here", "--no-figure", "--json")
    found = answer(done)
    assert (done.exit_code, done.stderr) == (0, "")
    promised = "status sentence run task apex_m duration_s cost solve_s build_s iterations"
    promised += " variables constraints residuals replay table_replay plant_replay worst good"
    assert set(promised.split()) <= set(found)
    assert set(found["residuals"]) == {"complementarity", "binary", "dynamics", "bounds"}
    assert found["cost"]["torque_squared_integral"] > 0
    assert (found["status"], found["task"], found["run"]) == ("solved", "max_jump", "here")
    assert found["apex_m"] >= 1.0 - 1e-6
    assert found["iterations"] > 0 and found["solve_s"] > 0
    assert found["variables"] > 500 and found["constraints"] > 500
    assert json.loads(Path("here/certificate.json").read_text()) == found


def test_the_path_on_stdout_and_talk_on_stderr() -> None:
    """A run of one's own task, in a folder of its own, with its figure."""
    task, _ = load_task("max_jump.yaml")
    assert task.nodes == 100
    done = run("max_jump.yaml", *PLAIN)
    assert (done.exit_code, done.stdout) == (0, "runs/max_jump-1\n")
    lines = done.stderr.splitlines()
    apex = load_run("runs/max_jump-1").certificate["apex_m"]
    assert apex >= 1.0 - 1e-6
    assert lines[-2].startswith(f"solved: apex {apex:.3f} m (feet ")
    assert lines[-1].startswith("next: kemba-opt simulate runs/max_jump-1")
    *stages, drawing, _, _ = lines
    assert stages and all("nodes)" in line for line in stages) and "drawing" in drawing
    files = {path.name for path in Path("runs/max_jump-1").iterdir()}
    assert {"task.yaml", "trajectory.csv", "controller.csv", "figure.png", "solver.log"} <= files
    again = load_task("runs/max_jump-1/task.yaml")[0]
    assert again == task.model_copy(update={"nodes": 24, "refine": "none"}), (
        "the resolved task is the task"
    )
    assert "Number of Iterations" in Path("runs/max_jump-1/solver.log").read_text()


def test_a_failed_solve_ends_with_one() -> None:
    done = run("jump.yaml", *COARSE, "--set", "solver.max_iterations=2", "--no-figure", "-q")
    assert (done.exit_code, done.stdout) == (1, "runs/jump-1\n")
    assert done.stderr.startswith("FAILED: a limit came before a plan was found")  # not hidden
    assert done.stderr.count("\n") == 1
    assert load_run("runs/jump-1").certificate["status"] == "limit"


def test_a_failed_solve_draws_what_it_has() -> None:
    done = run("jump.yaml", *COARSE, "--time-limit", "0.2", "--out", "short")
    assert done.exit_code == 1
    assert Path("short/figure.png").is_file()
    said, following = done.stderr.splitlines()[-2:]
    assert said.startswith("FAILED: a limit came before a plan was found")
    assert following == "next: kemba-opt report short"


def test_dry_run_says_the_size_and_solves_nothing() -> None:
    done = run("jump.yaml", "--dry-run")
    assert done.exit_code == 0
    size = answer(run("jump.yaml", "--dry-run", "--json"))
    told = f"{size['variables']} variables, {size['constraints']} constraints"
    assert done.stdout == f"jump: {told}\n"
    assert 2500 < size["variables"] < 4500, "the paper's program has 8982"
    assert not Path("runs").exists()
    assert run("jump.yaml", "--dry-run", "--set", "cost.torqe=1").exit_code == 2


def test_the_keys_of_the_shipped_jumps() -> None:
    options = ["height=0.6 m", "supply=0.65 MPa", "payload=0.5 kg", "duration=720 ms", "nodes=60"]
    task, _ = load_task("jump.yaml", options)
    assert (task.height, task.supply, task.payload) == (0.6, 0.65e6, 0.5)
    assert (task.duration, task.nodes) == (0.72, 60)
    model = task_model(task)
    assert model.supply == 0.65e6
    assert model.effect("payload").value("m") == 0.5


@pytest.mark.parametrize("name", ["jump", "max_jump", "hop", "jump_forward", "drop"])
def test_every_jump_has_these_keys(name: str) -> None:
    data = load_task(f"{name}.yaml")[1].data
    assert {"height", "supply", "payload", "duration", "nodes"} <= set(data)


def test_a_task_of_ones_own_beside_a_model_of_ones_own(tmp_path: Path) -> None:
    Path("own").mkdir()
    Path("own/heavy.yaml").write_text(
        "name: heavy\nbase: planning\neffects:\n  - {kind: payload, m: 1 kg}\n"
    )
    task = Path(load_task("jump.yaml")[1].source).read_text()
    Path("own/mine.yaml").write_text(task)
    size = answer(run("own/mine.yaml", "--model", "own/heavy.yaml", "--dry-run", "--json"))
    assert size["variables"] > 1000


@pytest.mark.slow
def test_from_a_fresh_process_in_another_folder(tmp_path: Path) -> None:
    words = ["solve", "max_jump.yaml", *PLAIN, "--no-figure", "--out", "there"]
    code = "from kemba_cli.main import main; main()"
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code, *words],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout) == (0, "there\n"), done.stderr
    plan = Trajectory.read(tmp_path / "there" / "trajectory.csv")
    assert plan["body/z"][-1] >= 1.0 - 1e-6
