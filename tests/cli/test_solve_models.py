"""`kemba-opt solve` and its models: looked for beside the task, and what a plan cannot use."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from kemba.ocp import load_task, task_model
from kemba_cli.main import app

HEAVY = """\
name: heavy
base: planning
effects:
  - {kind: payload, m: 1 kg}
  - {kind: sensor_bias, channel: body/pitch, b: 0.01}
"""


@pytest.fixture
def task(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A task in a folder with its model, and another model of that name where we are."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own").mkdir()
    (tmp_path / "own/heavy.yaml").write_text(HEAVY)
    (tmp_path / "heavy.yaml").write_text("name: other\nbase: planning\n")
    text = Path(load_task("jump.yaml")[1].source).read_text()
    path = tmp_path / "own/mine.yaml"
    path.write_text(text.replace("model: planning", "model: heavy.yaml"))
    return path


def test_a_model_is_looked_for_beside_its_task_first(task: Path) -> None:
    found = load_task("own/mine.yaml")[0]
    assert found.model == str(task.with_name("heavy.yaml"))
    assert task_model(found).name == "heavy"
    task.with_name("heavy.yaml").unlink()
    assert task_model(load_task("own/mine.yaml")[0]).name == "other", "then where we are"
    assert load_task("jump.yaml")[0].model == "planning", "then among the shipped ones"


def test_what_a_plan_cannot_use_is_told(task: Path) -> None:
    words = ["solve", str(task), "--set", "nodes=24", "--set", "solver.max_iterations=1"]
    done = CliRunner().invoke(app, [*words, "--no-figure", "--json"])
    assert json.loads(done.stdout)["ignored"] == ["sensor_bias:body/pitch"]
    assert "no plan can use sensor_bias:body/pitch: it changes what is measured only" in done.stderr


def test_a_plant_that_is_not_there_is_told_before_solving(task: Path) -> None:
    done = CliRunner().invoke(app, ["solve", str(task), "--set", "plant=plnt"])
    assert (done.exit_code, done.stdout) == (2, "")
    assert "plnt: no such file" in done.stderr and not Path("runs").exists()
