"""The verdict on executed plans: tolerances, words, exit code."""

from __future__ import annotations

import json
import math
from pathlib import Path
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from kemba.ocp.certificate.status import Status
from kemba.ocp.task.task import Tolerances
from kemba.solve.judged import Judged
from kemba.solve.trial import Motions, Trial
from kemba.solve.verdict import EXECUTIONS, Verdict, allowances, judge
from kemba_cli.main import app

LANDED = {
    "apex_error_m": 1e-5,
    "touchdown_error_s": -1e-6,
    "final_error_m": 1e-6,
    "landed": True,
    "fault": None,
}
FAILED = "FAILED: a plan was found, but the re-simulation reaches "
FELL = {"landed": False, "fault": "tips over"}
AIR = {"touchdown_error_s": None, "landed": False, "fault": "ends in the air"}


@pytest.mark.parametrize(
    ("key", "facts", "lands", "good", "told"),
    [
        ("replay", {}, True, True, "re-simulation matches the plan"),
        ("replay", {"touchdown_error_s": -4e-5}, True, True, "re-simulation matches the plan"),
        ("replay", {"touchdown_error_s": 1e-3}, True, True,
         "re-simulation matches the plan (touchdown 1.0 ms late, 2 ms allowed)"),
        ("replay", {"final_error_m": 0.029}, True, True,
         "re-simulation matches the plan (end 29.0 mm away, 30 mm allowed)"),
        ("replay", AIR, False, True, "re-simulation matches the plan"),
        ("replay", AIR, True, False, "the re-simulation ends in the air"),
        ("replay", {"apex_error_m": -0.0262}, True, False,
         "the re-simulation reaches 26.2 mm below the planned apex (2 mm allowed)"),
        ("replay", {"touchdown_error_s": 0.0174}, True, False,
         "the re-simulation touches down 17.4 ms late (2 ms allowed)"),
        ("replay", {"final_error_m": 0.12, "apex_error_m": 0.003}, True, False,
         "the re-simulation reaches 3.0 mm above the planned apex (2 mm allowed) and ends 120.0 mm "
         "from the plan (30 mm allowed)"),
        ("plant_replay", {"apex_error_m": 0.04, "touchdown_error_s": 0.003, "final_error_m": 0.01},
         True, True, "simulated robot matches the plan (apex 40.0 mm higher, 50 mm allowed)"),
        ("plant_replay", {"touchdown_error_s": 0.074, "final_error_m": 0.194}, True, False,
         "the simulated robot touches down 74.0 ms late (25 ms allowed) and ends 194.0 mm from the "
         "plan (50 mm allowed)"),
        ("table_replay", {"apex_error_m": -0.0029}, True, False,
         "the re-simulation of controller.csv reaches 2.9 mm below the planned apex (2 mm "
         "allowed)"),
        ("table_replay", {"touchdown_error_s": -0.021, "final_error_m": 0.031}, True, False,
         "the re-simulation of controller.csv touches down 21.0 ms early (3 ms allowed) and ends "
         "31.0 mm from the plan (30 mm allowed)"),
        ("plant_replay", {"apex_error_m": -0.06}, True, False,
         "the simulated robot reaches 60.0 mm below the planned apex (50 mm allowed)"),
        ("plant_replay", FELL, True, False, "the simulated robot tips over"),
    ],
)  # fmt: skip
def test_a_verdict_says_what_matches_or_what_fails(
    key: str, facts: dict[str, object], lands: bool, good: bool, told: str
) -> None:
    found = judged_as(key, facts, lands=lands)
    assert (found.good, found.sentence) == (good, told)


def judged_as(
    key: str, facts: dict[str, object], tolerances: Tolerances | None = None, lands: bool = True
) -> Verdict:
    """The verdict on an execution that is `LANDED` but for some facts, of a fall at 1 m/s."""
    allowed = allowances(tolerances or Tolerances(), lands, 1.0)[key]
    return judge(EXECUTIONS[key], {**LANDED, **facts}, allowed)


def test_what_cannot_be_started_confirms_nothing() -> None:
    found = judge(EXECUTIONS["replay"], None, allowances(Tolerances(), True, 1.0)["replay"])
    assert (found.good, found.sentence) == (False, "the re-simulation cannot be started")


@pytest.mark.parametrize(
    ("facts", "share"),
    [({}, 0.005), ({"touchdown_error_s": -0.004}, 2.0), (FELL, math.inf)],
)
def test_a_verdict_measures_the_largest_error(facts: dict[str, object], share: float) -> None:
    found = judged_as("replay", facts)
    assert found.share == pytest.approx(share)


def run(plant: float, table: float, good: bool) -> Trial:
    """A plan whose executions miss by these shares of what is allowed."""
    shares = {"replay": 0.0, "table_replay": table, "plant_replay": plant}
    found = {key: Verdict(share <= 1.0, "", share) for key, share in shares.items()}

    status = Status.SOLVED if good else Status.ACCEPTABLE
    plan = SimpleNamespace(status=status, model=None, task=None, requirements=(), trajectory=None)
    judged = Judged({}, found, None)
    return Trial(plan, {"good": good}, Motions(), judged)  # type: ignore[arg-type]


def test_of_plans_that_fail_the_nearest_is_best(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kemba.solve.trial.objective", lambda *parts: 1.0)
    far, near = run(7.6, 0.1, False), run(1.7, 0.1, False)
    assert near.score > far.score
    good, exact = run(0.9, 0.8, True), run(0.9, 0.1, True)
    assert good.score > near.score and exact.score > good.score
    assert exact.fine and not good.fine


def test_tolerances_are_the_tasks() -> None:
    facts: dict[str, object] = {"apex_error_m": 0.004}
    assert not judged_as("replay", facts).good
    assert judged_as("replay", facts, Tolerances(apex=0.005)).good


@pytest.mark.parametrize(("speed", "late"), [(1.0, 0.025), (4.0, 0.0125), (0.0, 0.025)])
def test_a_plant_may_land_as_late_as_its_apex_may_be_off(speed: float, late: float) -> None:
    """5 cm at the speed of the landing, 25 ms at most; what the task says itself comes first."""
    assert allowances(Tolerances(), True, speed)["plant_replay"].touchdown == pytest.approx(late)
    own = allowances(Tolerances(plant_touchdown=0.04), True, speed)["plant_replay"]
    assert own.touchdown == 0.04


@pytest.mark.parametrize(
    ("more", "code"), [((), 1), (("--set", "tolerances.apex=1 m"), 0), (("--no-replay",), 0)]
)
def test_a_plan_whose_replay_misses_is_not_solved_and_ends_with_one(
    tmp_path: Path, more: tuple[str, ...], code: int
) -> None:
    """Implicit Euler on a coarse grid promises a metre that it does not reach."""
    words = ["solve", "max_jump.yaml", "--set", "nodes=24", "--set", "refine=none", "--no-figure"]
    words += ["--set", "tolerances.plant_apex=1 m", "--set", "tolerances.final=1 m"]
    for where in ("table_apex", "table_final", "plant_final"):
        words += ["--set", f"tolerances.{where}=1 m"]
    done = CliRunner().invoke(app, [*words, "--json", "--out", str(tmp_path / "run"), *more])
    answer = json.loads(done.stdout)
    status = "acceptable" if code else "solved"
    assert (done.exit_code, answer["status"], answer["good"]) == (code, status, code == 0)
    assert answer["sentence"].startswith(FAILED if code else "solved: ")
    told = "planned apex (2 mm allowed)" in answer["sentence"]
    assert told == (code == 1)
    manifest = json.loads((tmp_path / "run" / "manifest.json").read_text())
    assert (manifest["good"], manifest["status"]) == (answer["good"], status)
