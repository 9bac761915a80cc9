"""The verdict on executed plans: tolerances, words, exit code."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from kemba.ocp.task.task import Tolerances
from kemba.report.verdict import verdicts
from kemba_cli.main import app

LANDED = {
    "apex_error_m": 1e-5,
    "touchdown_error_s": -1e-6,
    "final_error_m": 1e-6,
    "landed": True,
    "fault": None,
}
FELL = {"landed": False, "fault": "tips over"}
AIR = {"touchdown_error_s": None, "landed": False, "fault": "the plan ends in the air"}


@pytest.mark.parametrize(
    ("key", "facts", "lands", "good", "told"),
    [
        ("replay", {}, True, True, "replay reaches 0.0 mm above the plan, touches down 0.0 ms "
         "early and lands"),
        ("replay", AIR, False, True, "replay reaches 0.0 mm above the plan"),
        ("replay", AIR, True, False, "but the replay reaches 0.0 mm above the plan and does not "
         "land (the plan ends in the air)"),
        ("replay", {"apex_error_m": -0.0262}, True, False, "but the replay reaches 26.2 mm below "
         "the plan (2 mm allowed), touches down 0.0 ms early and lands"),
        ("replay", {"touchdown_error_s": 0.0174}, True, False, "but the replay reaches 0.0 mm "
         "above the plan, touches down 17.4 ms late (2 ms allowed) and lands"),
        ("replay", {"final_error_m": 0.12}, True, False, "but the replay reaches 0.0 mm above the "
         "plan, touches down 0.0 ms early, ends 120.0 mm from the plan (30 mm allowed) and lands"),
        ("plant_replay", {"apex_error_m": 0.04, "touchdown_error_s": 0.03, "final_error_m": 0.1},
         True, True, "plant reaches 40.0 mm above the plan, touches down 30.0 ms late and lands"),
        ("plant_replay", {"apex_error_m": -0.06}, True, False, "but the plant reaches 60.0 mm "
         "below the plan (50 mm allowed), touches down 0.0 ms early and lands"),
        ("plant_replay", FELL, True, False, "but the plant reaches 0.0 mm above the plan, touches "
         "down 0.0 ms early and does not land (tips over)"),
    ],
)  # fmt: skip
def test_misses_are_told_with_what_is_allowed(
    key: str, facts: dict[str, object], lands: bool, good: bool, told: str
) -> None:
    found = verdicts({key: {**LANDED, **facts}}, Tolerances(), lands)[key]
    assert (found.good, found.sentence) == (good, told)


def test_what_cannot_be_started_confirms_nothing() -> None:
    found = verdicts({"replay": None}, Tolerances(), True)["replay"]
    assert (found.good, found.sentence) == (False, "but the replay cannot be started")


def test_tolerances_are_the_tasks() -> None:
    facts = {**LANDED, "apex_error_m": 0.004}
    assert not verdicts({"replay": facts}, Tolerances(), True)["replay"].good
    assert verdicts({"replay": facts}, Tolerances(apex=0.005), True)["replay"].good


@pytest.mark.parametrize(
    ("more", "code"), [((), 1), (("--set", "tolerances.apex=1 m"), 0), (("--no-replay",), 0)]
)
def test_a_plan_whose_replay_misses_is_not_solved_and_ends_with_one(
    tmp_path: Path, more: tuple[str, ...], code: int
) -> None:
    """Implicit Euler on a coarse grid promises a metre that it does not reach."""
    words = ["solve", "max_jump.yaml", "--set", "nodes=24", "--set", "refine=none", "--no-figure"]
    words += ["--set", "tolerances.plant_apex=1 m", "--set", "tolerances.final=1 m"]
    done = CliRunner().invoke(app, [*words, "--json", "--out", str(tmp_path / "run"), *more])
    answer = json.loads(done.stdout)
    status = "acceptable" if code else "solved"
    assert (done.exit_code, answer["status"], answer["good"]) == (code, status, code == 0)
    assert answer["sentence"].startswith("acceptable, the plan is solved: " if code else "solved: ")
    told = "but the replay reaches" in answer["sentence"] and "(2 mm allowed)" in answer["sentence"]
    assert told == (code == 1)
    manifest = json.loads((tmp_path / "run" / "manifest.json").read_text())
    assert (manifest["good"], manifest["status"]) == (answer["good"], status)
