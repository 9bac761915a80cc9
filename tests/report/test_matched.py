"""Where the plant does not move as planned, the plan is made again with fitted air."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from typer.testing import CliRunner

from kemba.config import dump_yaml
from kemba.ocp import load_task
from kemba.plant.execution.fitted_air import FittedAir
from kemba.report.judging import matched
from kemba.report.judging.remedies import Remedies, TriedAir, between
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


def fit(factor: float) -> FittedAir:
    return FittedAir({"chamber.F_extend": factor, "chamber.vent": 2.0 - factor}, 3.0, 1.0)


def test_between_figures_on_both_sides_the_secant_is_tried() -> None:
    found = between([TriedAir(None, 0.06), TriedAir(fit(0.8), -0.02)])
    assert found is not None
    assert found.factors["chamber.F_extend"] == pytest.approx(0.85)  # a quarter back to 1
    assert found.factors["chamber.vent"] == pytest.approx(1.15)
    again = between([TriedAir(None, 0.06), TriedAir(fit(0.8), -0.02), TriedAir(found, 0.02)])
    assert again is not None and again.factors["chamber.F_extend"] == pytest.approx(0.825)


def test_on_one_side_the_air_is_fitted_again() -> None:
    assert between([TriedAir(None, 0.06)]) is None
    assert between([TriedAir(None, 0.06), TriedAir(fit(0.8), 0.02)]) is None
    assert between([TriedAir(None, 0.06), TriedAir(fit(0.8), 0.0)]) is None, "or nothing lands"


@pytest.mark.parametrize(("times", "kept"), [(2.9, True), (3.1, False)])
def test_a_continued_plan_that_costs_much_more_is_not_kept(
    monkeypatch: pytest.MonkeyPatch, times: float, kept: bool
) -> None:
    """One from a guess is likely to cost less."""
    task, document = load_task("jump.yaml")

    def plan(cost: float) -> Any:
        common = {"task": task, "model": None, "requirements": (), "stages": None}
        return SimpleNamespace(trajectory=cost, continued=None, start="guess", **common)

    for place in ("kemba.ocp.continued", "kemba.report.judging.matched"):
        monkeypatch.setattr(f"{place}.objective", lambda model, task, asked, cost: cost)

    new = plan(times)
    monkeypatch.setattr(matched, "plan_from", lambda *given, **how: (new, ""))
    found = matched._continued(plan(1.0), task, document, Remedies(task), {})
    assert (found is new) is kept


def test_a_low_jump_lands_when_it_should(tmp_path: Path) -> None:
    """At 0.45 m feet rise a centimetre: with the tables the plant lands 68 ms late, with one fit
    early."""
    words = ["solve", "jump.yaml", "--set", "height=0.45 m", "--no-figure", "--json"]
    done = CliRunner().invoke(app, [*words, "--out", str(tmp_path / "run")])
    answer = json.loads(done.stdout)
    assert done.exit_code == 0 and answer["good"], answer["sentence"]
    assert abs(answer["plant_replay"]["touchdown_error_s"]) <= 0.015
