"""`kemba-opt simulate` and `characterise`, as scripts see them."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from kemba.mechanism import load_robot, robot_mechanism
from kemba.plant.controller import read_controller
from kemba.trajectory import Trajectory
from kemba_cli.main import app

RIG = """\
rig:
  kind: {kind}
  name: {name}
"""


def run(*words: str) -> Result:
    return CliRunner().invoke(app, [*words])


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def folder() -> Path:
    """A run whose plan is to stand still for 30 ms, and push a little."""
    time, pose = np.arange(0, 0.03, 1e-3), robot_mechanism(load_robot("kemba")).standing
    same = np.ones(len(time))
    columns = {"body/x [m]": 0 * same, "body/z [m]": pose["body/z"] * same}
    for leg in ("front", "rear"):
        columns[f"{leg}/hip/q [rad]"] = pose[f"{leg}/hip/q"] * same
        columns[f"{leg}/hip/w [rad.s-1]"] = 0 * same
        columns[f"{leg}/hip/tau [N.m]"] = 0 * same
        columns[f"{leg}/valve/extend [1]"] = (time > 0.002).astype(float)
        columns[f"{leg}/valve/retract [1]"] = 0 * same
    Trajectory(time, columns, {"lead": 0.0}).write("runs/still-1/controller.csv")
    Trajectory(time, columns).write("runs/still-1/trajectory.csv")
    return Path("runs/still-1")


def test_three_noisy_logs_of_a_run(folder: Path) -> None:
    done = run("simulate", str(folder), "--model", "planning", "--repeat", "3", "--noise", "--json")
    assert done.exit_code == 0, done.output
    answer = json.loads(done.stdout)
    assert answer["logs"] == [f"runs/still-1/logs/log-{i}.csv" for i in (1, 2, 3)]
    assert [item["landed"] for item in answer["runs"]] == [True] * 3
    logs = [Trajectory.read(path) for path in answer["logs"]]
    assert [log.meta["run"] for log in logs] == [1, 2, 3]
    assert {log.meta["repeat_of"] for log in logs} == {"still-1"}
    assert logs[0].meta["kind"] == "robot"
    assert not np.array_equal(logs[0]["body/z"], logs[1]["body/z"])


def test_no_log_is_replaced_without_force(folder: Path) -> None:
    words = ["simulate", str(folder), "--model", "planning"]
    for name in ("logs", "logs-2"):
        assert run(*words).stdout == f"runs/still-1/{name}/log-1.csv\n"
    before = Path("runs/still-1/logs/log-1.csv").read_bytes()
    done = run(*words, "--noise", "--out", "runs/still-1/logs")
    assert done.exit_code == 2 and "holds results already (log-1.csv)" in done.stderr
    assert Path("runs/still-1/logs/log-1.csv").read_bytes() == before
    assert run(*words, "--noise", "--out", "runs/still-1/logs", "--force").exit_code == 0
    assert Path("runs/still-1/logs/log-1.csv").read_bytes() != before


def test_the_plant_meets_the_supply_and_payload_of_the_task(folder: Path) -> None:
    heights = []
    for task in ("supply: 0.6 MPa\n", "supply: 800000.0\n", "supply: 0.8 MPa\npayload: 2 kg\n"):
        (folder / "task.yaml").write_text(task)
        done = run("simulate", str(folder), "--model", "planning", "--json")
        heights.append(Trajectory.read(json.loads(done.stdout)["logs"][0])["body/vz"][-1])
    assert heights[0] < heights[1] > heights[2]


def test_a_noisy_log_shows_the_valves_as_they_are_sent(folder: Path) -> None:
    """However late each of them acts, and whenever the row was written."""
    shown = run("simulate", str(folder), "--noise", "--out", "noisy", "--json")
    log = Trajectory.read(json.loads(shown.stdout)["logs"][0])
    table = read_controller(folder)
    valves = [name for name in table.names if "/valve/" in name]
    assert valves and all(np.array_equal(log[name], table[name][: len(log)]) for name in valves)


def test_the_same_seed_writes_the_same_log(folder: Path) -> None:
    texts = []
    for out, seed in (("a", "4"), ("b", "4"), ("c", "5")):
        words = ("--model", "planning", "--noise", "--seed", seed, "--out", out)
        assert run("simulate", str(folder), *words).exit_code == 0
        texts.append(Path(out, "log-1.csv").read_text())
    assert texts[0] == texts[1] != texts[2]


def test_mistakes_are_wrong_usage(folder: Path) -> None:
    done = run("simulate", "nowhere")
    assert (done.exit_code, done.stdout) == (2, "")
    assert (
        done.stderr
        == "nowhere: no such run folder or table; make one with: kemba-opt solve jump.yaml\n"
    )
    Path("bad.yaml").write_text("rig:\n  kind: locked\n  name: x\n  positons: [0.0]\n")
    assert "did you mean 'positions'?" in run("simulate", "bad.yaml").stderr
    assert run("simulate", str(folder), "--model", "plannin").exit_code == 2


def test_from_rig_to_model() -> None:
    for kind, name in (("locked", "locked"), ("dynamometer", "slow")):
        more = "  speeds: {extend: [0.5, 0.8]}\n" if kind == "dynamometer" else ""
        Path(f"{name}.yaml").write_text(RIG.format(kind=kind, name=name) + more)
        done = run("simulate", f"{name}.yaml", "--model", "planning")
        assert (done.exit_code, done.stdout) == (0, f"bench/{name}\n")
    words = ("characterise", "bench/locked", "bench/slow")
    shown = run(*words)
    assert shown.exit_code == 0
    assert "Chamber force rise time" in shown.stdout
    answer = json.loads(run(*words, "--out", "mine.yaml", "--json").stdout)
    rise, force = answer["table_1"][0], answer["table_2"][0]
    assert (rise["chamber"], rise["paper"]) == ("fill", 0.008)
    assert rise["value"] == pytest.approx(0.008, abs=2e-4)
    assert force["c_d"]["value"] == pytest.approx(97.0, abs=0.5)
    assert answer["model"] == "mine.yaml"
    assert run("check", "mine.yaml").exit_code == 0
    for path in Path("bench/locked").glob("*.csv"):  # the cylinder may be another, so it is fitted
        names = path.read_text().replace("extend [", "x [").replace("valve/retract", "valve/extend")
        path.write_text(names.replace("valve/x [", "valve/retract ["))
    doubted = run("characterise", "bench/locked")
    assert doubted.exit_code == 0 and "valve/retract are swapped; the" in doubted.stderr


def test_shipped_rigs_are_valid() -> None:
    assert run("check", *(f"{n}.yaml" for n in ("locked", "volumes", "random"))).exit_code == 0
