"""`import kemba`: what a shell script can do, a script or notebook can."""

import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import kemba
from kemba.api.planning import Executions, Planned
from kemba.errors import ConfigErrors, KembaError
from kemba.trajectory import Trajectory
from kemba_cli.main import app


@pytest.fixture(scope="module")
def stages() -> list[str]:
    return []


@pytest.fixture(scope="module")
def jump(tmp_path_factory: pytest.TempPathFactory, stages: list[str]) -> Planned:
    out = tmp_path_factory.mktemp("library") / "jump"
    return kemba.plan("jump.yaml", out, height="0.5 m", progress=stages.append)


@pytest.fixture(scope="module")
def done(jump: Planned) -> Executions:
    return kemba.simulate(jump, repeat=2, noise=True, seed=3)


def test_a_plan_is_an_object(jump: Planned, stages: list[str]) -> None:
    assert jump.good and jump.sentence.startswith("solved")
    assert jump.trajectory["body/z"].max() == pytest.approx(0.5, abs=1e-3)
    assert jump.controller.time[-1] >= jump.trajectory.time[-1]
    assert "replay: the plan's inputs (1 of 3)" in stages and len(stages) > 2
    assert Planned.read(jump.path).certificate == jump.certificate


def test_results_show_themselves_in_notebooks(jump: Planned) -> None:
    page = jump._repr_html_()
    assert "solved" in page and 'src="data:image/png;base64,' in page and 'alt="' in page
    assert len(jump.figure().axes) > 3


def test_executions_give_logs_that_compare_reads(done: Executions) -> None:
    assert done.landed == 2 and done.good and len(done.logs) == 2
    assert "2 of 2 landed" in str(done)
    found = kemba.compare(done.logs[0].parent, run=done.run)  # the folder stands for both
    assert found.noise_ratio > 1.0 and not found.good  # the plant has effects that plans lack
    assert found.figure().axes


def test_a_log_is_a_mapping_and_a_table(done: Executions) -> None:
    log = kemba.load_log(done.logs[0])
    assert (
        set(dict(log)) == set(log.names)
        and len(log.values()) == len(log.names)
        and len(log) == len(log.time)
    )
    frame = log.to_pandas()
    assert list(frame.columns) == list(log.headers)
    assert np.array_equal(frame["body/z [m]"], log["body/z"])
    assert "<table" in log._repr_html_()
    assert log.get("no/such") is None
    assert list(log.columns) == list(log.headers)


def test_discover_says_why_data_are_bad(tmp_path: Path) -> None:
    t = np.arange(400) * 1e-3
    log = {"piston/x [m]": 5.0 + 0 * t, "piston/F [N]": t, "valve/extend [1]": t > 0.1}
    Trajectory(t, {**log, "valve/retract [1]": 0 * t}).write(tmp_path / "a.csv")
    found = kemba.discover(tmp_path / "a.csv")
    assert found.verdict == "bad-data" and not found.good
    with pytest.raises(KembaError, match="not fitted"):
        found.figure()
    assert "<img" not in found._repr_html_()
    out = tmp_path / "answer"
    kemba.discover(tmp_path / "a.csv", out=out)
    with pytest.raises(KembaError, match="holds results already"):
        kemba.discover(tmp_path / "a.csv", out=out)
    kemba.discover(tmp_path / "a.csv", out=out, force=True)


def test_tasks_and_models_load_by_name() -> None:
    task = kemba.load_task("jump.yaml", height="0.6 m", **{"solver.time_limit": 9})
    assert task.solver.time_limit == 9
    assert kemba.load_model("plant").name == "plant"
    with pytest.raises(ConfigErrors, match="did you mean"):
        kemba.load_task("jump.yaml", hieght="0.6 m")


def test_import_is_quick_and_names_are_listed() -> None:
    code = "import sys, kemba; print('numpy' in sys.modules, 'casadi' in sys.modules, dir(kemba))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("False False") and "'discover'" in done.stdout
    with pytest.raises(AttributeError, match="no attribute 'solv'"):
        _ = kemba.solv


def test_every_verb_has_its_function() -> None:
    """The page names one for each, and what it names exists."""
    page = (Path(__file__).parents[2] / "docs/library.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)` \| (.+) \|$", page, flags=re.MULTILINE)
    verbs = {command.name for command in app.registered_commands}
    assert {verb for verb, _ in rows} | set(kemba.__all__) | {"solve"} >= verbs
    for _, text in rows:
        for name in re.findall(r"`(kemba(?:\.\w+)+)", text):
            module, _, function = name.rpartition(".")
            assert callable(getattr(import_module(module), function)), name
