"""Where the plant does not move as planned, the plan is made again with fitted air."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from kemba.config import dump_yaml
from kemba.ocp import load_task
from kemba_cli.main import app

WEAK = {"kind": "chamber", "F_extend": [258, 291, 314], "F_retract": [239, 260, 291]}  # 10 % less


def planned(folder: Path, *options: str) -> dict[str, object]:
    """The answer of `solve` for the shipped jump on a plant whose legs push 10 % less than planned,
    written to `folder`."""
    plant = folder.parent / "weak.yaml"
    dump_yaml({"name": "weak", "base": "planning", "effects": [WEAK]}, plant)
    words = ["solve", "jump.yaml", "--no-figure", "--json", "--out", str(folder)]
    for option in (f"plant={plant}", *options):
        words += ["--set", option]
    answer: dict[str, object] = json.loads(CliRunner().invoke(app, words).stdout)
    return answer


def test_a_plan_for_weaker_legs_comes_true_on_them(tmp_path: Path) -> None:
    answer = planned(tmp_path / "run")
    assert answer["good"], answer["sentence"]
    assert "fitted to the simulated robot (F_extend -" in str(answer["sentence"])
    assert answer["fitted_air"]["factors"]["chamber.F_extend"] == pytest.approx(0.9, abs=0.05)
    assert abs(answer["plant_replay"]["touchdown_error_s"]) <= 0.015
    task, _ = load_task(tmp_path / "run" / "task.yaml")  # the run says with which figures
    assert set(task.effects) == {"chamber", "mode_damping"}


def test_who_wants_the_tables_keeps_them(tmp_path: Path) -> None:
    answer = planned(tmp_path / "run", "fit_air=false")
    assert not answer["good"] and "fitted_air" not in answer
    assert "FAILED: a plan was found, but the simulated robot" in str(answer["sentence"])
