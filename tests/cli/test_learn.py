"""`kemba-opt learn` with nothing given: the newest run and its logs, and what it says of them."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from kemba.config import shipped_configs
from kemba.trajectory import Trajectory
from kemba_cli.main import app


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def learn(*words: str) -> Result:
    return CliRunner().invoke(app, ["learn", *words])


def run_of(name: str, started: str) -> Path:
    """A run folder that was never solved: task, manifest and a controller that commands nothing."""
    folder = Path("runs") / name
    folder.mkdir(parents=True)
    shutil.copy(shipped_configs("tasks")["jump.yaml"], folder / "task.yaml")
    manifest = {"status": "solved", "task": "jump", "started": started}
    (folder / "manifest.json").write_text(json.dumps(manifest))
    Trajectory(np.arange(3.0), {"body/z [m]": np.zeros(3)}).write(folder / "controller.csv")
    return folder


def test_without_a_run_it_says_how_to_make_one() -> None:
    done = learn()
    assert done.exit_code == 2
    assert "runs: there is no run here yet; make one with: kemba-opt solve jump.yaml" in done.stderr
    assert "kemba-opt solve jump.yaml" in done.stderr


def test_without_logs_it_says_how_to_get_them() -> None:
    run_of("jump-1", "2026-01-01T10:00:00+00:00")
    run_of("jump-2", "2026-01-02T10:00:00+00:00")
    done = learn()
    assert done.exit_code == 2
    assert done.stderr.splitlines()[0] == "the newest run: runs/jump-2"
    assert "runs/jump-2: has no logs" in done.stderr
    assert "kemba-opt simulate runs/jump-2 --repeat 3 --noise" in done.stderr


def test_it_takes_the_newest_logs_of_the_newest_run() -> None:
    """These cannot be read, and the message is about them."""
    run_of("jump-2", "2026-01-02T10:00:00+00:00")
    logs = run_of("jump-1", "2026-01-03T10:00:00+00:00") / "logs"
    logs.mkdir()
    (logs / "log-1.csv").write_text("time [s],nonsense\n0,1\n")
    done = learn()
    said = done.stderr.splitlines()
    assert done.exit_code == 2
    assert said[:2] == [
        "the newest run: runs/jump-1",
        "with its newest logs: 1 in runs/jump-1/logs",
    ]
    assert "runs/jump-1/logs/log-1.csv" in done.stderr
