"""`kemba-opt plot`, as scripts see it."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from kemba.trajectory import Trajectory
from kemba_cli.main import app

TIME = np.linspace(0.0, 0.2, 9)


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    pose = {"hip/q [rad]": 0.5, "piston/x [m]": 0.03}
    columns = {
        f"{leg}/{name}": value + TIME for leg in ("front", "rear") for name, value in pose.items()
    }
    whole = Trajectory(TIME, {"body/z [m]": 0.3 + TIME, **columns})
    whole.write("runs/jump-1/trajectory.csv")
    whole.select(["body/z"]).write("log.csv")


def run(*words: str) -> Result:
    return CliRunner().invoke(app, ["plot", *words])


def test_the_figure_goes_into_the_run() -> None:
    done = run("runs/jump-1")
    assert (done.exit_code, done.stdout) == (0, "runs/jump-1/figure.png\n")
    assert Path("runs/jump-1/figure.png").read_bytes().startswith(b"\x89PNG")


def test_no_figure_is_replaced_without_force() -> None:
    for name in ("figure", "figure-2", "figure-3"):
        assert run("runs/jump-1").stdout == f"runs/jump-1/{name}.png\n"
    Path("a.png").write_text("mine")
    done = run("log.csv", "--save", "a.png")
    assert done.exit_code == 2 and "--out a.png: exists already" in done.stderr
    assert Path("a.png").read_text() == "mine"
    assert run("log.csv", "--save", "a.png", "--force").exit_code == 0
    assert Path("a.png").read_bytes().startswith(b"\x89PNG")


def test_a_bare_plot_draws_the_newest_run() -> None:
    done = run()
    assert (done.stdout, done.stderr) == (
        "runs/jump-1/figure.png\n",
        "the newest run: runs/jump-1\n",
    )
    assert (run("-q").stdout, run("-q").stderr) == ("runs/jump-1/figure-2.png\n", "")


def test_json_names_every_file() -> None:
    done = run("runs/jump-1", "log.csv", "--save", "a.pdf", "--animate", "b.gif", "--json")
    assert json.loads(done.stdout) == {
        "figure": "a.pdf",
        "animation": "b.gif",
        "runs": ["jump-1", "log"],
    }
    assert Path("a.pdf").is_file() and Path("b.gif").is_file()


def test_mistakes_are_wrong_usage() -> None:
    done = run("nope")
    assert (done.exit_code, done.stdout) == (2, "")
    assert done.stderr == (
        "nope: no such file or folder; a run folder or a log was expected; runs here: runs/jump-1\n"
    )
    assert run("log.csv", "--save", "a.doc").exit_code == 2


def test_no_window_without_a_display(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MPLBACKEND", "agg")
    done = run("log.csv", "--show")
    assert done.exit_code == 2
    assert done.stderr.startswith("--show: there is no display for a window; leave --show out")
