"""`solve` as a whole: replays in the certificate, several starts, the best kept."""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from plain_task import plain_task
from typer.testing import CliRunner

from kemba.files import WriteError
from kemba.ocp import load_task, task_model
from kemba.plant.certificate import SETTLE
from kemba.plant.controller import execute
from kemba.plant.repeat import counterpart
from kemba.plant.replay import replay
from kemba.report.solving import solve_into
from kemba.runs import RunFolder
from kemba.solve import Approach, Listener
from kemba.trajectory import Trajectory
from kemba_cli.main import app

OPTIONS = ["nodes=30", "solver.time_limit=120 s"]


def figures(summary: dict[str, Any]) -> dict[str, Any]:
    """An execution's figures without the list of its events."""
    return {key: value for key, value in summary.items() if key not in ("events", "end")}


def test_the_certificate_tells_what_execution_gave(tmp_path: Path) -> None:
    task, document = load_task("hop.yaml", OPTIONS)
    folder = RunFolder.create(tmp_path / "run", task.name)
    answer = solve_into(folder, task, document, Listener(), figure=False)
    assert answer == json.loads((folder / "certificate.json").read_text())
    own = task_model(load_task(folder / "task.yaml")[0])  # with fitted air, if that was needed
    again = replay(own, Trajectory.read(folder / "trajectory.csv")).summary()
    assert figures(answer["replay"]) == pytest.approx(figures(again), abs=1e-9)
    full = counterpart(task.model, task.payload, task.supply)
    plan = Trajectory.read(folder / "trajectory.csv")
    there = execute(folder.path, full, extra=SETTLE).against(full, plan).summary()
    assert figures(answer["plant_replay"]) == pytest.approx(figures(there), abs=1e-6)
    allowed, (same, plant) = task.tolerances, (answer["replay"], answer["plant_replay"])
    assert answer["good"], answer["sentence"]
    assert abs(same["apex_error_m"]) <= allowed.apex
    assert abs(same["touchdown_error_s"] or 0.0) <= allowed.touchdown
    assert same["final_error_m"] <= allowed.final
    assert abs(plant["apex_error_m"]) <= allowed.plant_apex
    assert same["landed"] and plant["landed"]
    assert "re-simulation matches the plan" in answer["sentence"]
    assert "simulated robot matches the plan" in answer["sentence"]


SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in ("jump", "max_jump", "hop", "stand")]


@pytest.mark.parametrize("name", ["drop", *SLOW])
def test_shipped_jumps_come_true(tmp_path: Path, name: str) -> None:
    """As planned on the same model, upright and within 5 cm on the plant; valves exactly binary."""
    words = ["solve", f"{name}.yaml", "--no-figure", "--json", "--out", str(tmp_path / "run")]
    done = CliRunner().invoke(app, words)
    answer = json.loads(done.stdout)
    assert (done.exit_code, answer["good"]) == (0, True), answer["sentence"]
    replay, plant = answer["replay"], answer["plant_replay"]
    assert abs(replay["apex_error_m"]) <= 2e-3
    assert abs(replay["touchdown_error_s"] or 0.0) <= 2e-3
    assert replay["landed"] == plant["landed"] == (name != "max_jump")
    assert abs(plant["apex_error_m"]) <= 0.05
    assert answer["residuals"]["binary"] == 0.0


@pytest.mark.slow
def test_the_best_of_several_starts_is_kept(tmp_path: Path) -> None:
    task, document = load_task("hop.yaml", OPTIONS)
    told: list[str] = []
    folder = RunFolder.create(tmp_path / "run", task.name)
    listener = Listener(told.append)
    answer = solve_into(
        folder, task, document, listener, Approach(starts=2, jobs=2, replay=False), figure=False
    )
    tried = [line for line in told if line.startswith("start ")]
    assert answer["status"] == "solved"
    assert len(tried) == 2
    best = min(float(line.rsplit(" ", 1)[1]) for line in tried if "solved" in line)
    assert answer["cost"]["torque_squared_integral"] <= best * 1.05 + 1e-3


def test_a_refined_plan_tells_the_impulses_on_its_feet(tmp_path: Path) -> None:
    """A dropped robot loses its fall at touchdown: momentum that no force column holds."""
    task, document = load_task("drop.yaml", ["nodes=40"])
    folder = RunFolder.create(tmp_path / "run", task.name)
    answer = solve_into(folder, task, document, Listener(), Approach(replay=False), figure=False)
    assert "phases of contacts and valves" in answer["sentence"]
    plan = Trajectory.read(folder / "trajectory.csv")
    impulse = plan["front/foot/impulse_z"]
    hits = impulse.nonzero()[0]
    touched = int((plan["front/foot/z"] <= 1e-6).argmax())
    assert hits[0] == touched and impulse[touched] > 0.05
    assert plan.unit("front/foot/impulse_x") == "N.s"


def test_a_plan_survives_a_folder_that_cannot_be_written(tmp_path: Path) -> None:
    """Something else holds the name of the plan's file, so the plan is written elsewhere."""
    task, document = load_task(plain_task(tmp_path), ["nodes=16", "refine=none"])
    folder = RunFolder.create(tmp_path / "run", task.name)
    (folder / "trajectory.csv").mkdir()
    with pytest.raises(WriteError, match=r"the plan is kept in .*; give a place") as told:
        solve_into(folder, task, document, Listener(), Approach(replay=False), figure=False)
    kept = Path(str(told.value).partition("kept in ")[2].partition(";")[0])
    assert len(Trajectory.read(kept / "trajectory.csv").time) == 17
    assert json.loads((tmp_path / "run" / "manifest.json").read_text())["status"] == "failed"
    shutil.rmtree(kept)
