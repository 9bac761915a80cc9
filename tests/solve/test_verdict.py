"""The verdict on executed plans: tolerances, words, exit code."""

import json
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from kemba.events import Event, EventComparison
from kemba.ocp.certificate.status import Status
from kemba.ocp.task.task import Tolerances
from kemba.plant.replay import EndError, Replay
from kemba.solve.judged import Judged
from kemba.solve.trial import Motions, Trial
from kemba.solve.verdict import EXECUTIONS, Verdict, allowances, judge
from kemba.trajectory import Trajectory
from kemba_cli.main import app

NOTHING = Trajectory([0.0], {})
LANDED = Replay(1e-5, -1e-6, 1e-6, None, NOTHING, ())
FAILED = "FAILED: a plan was found, but the re-simulation reaches "
FELL = {"fault": "tips over"}
STILL = EndError(0.0, 0.0, 0.0)


def events(*late: float, **other: float | None) -> dict[str, object]:
    """Landings of front and rear foot in turn that are `late` [s], with flights between."""
    found = []
    for i, late_s in enumerate(late):
        flown = {"height_error_m": 0.0, "x_error_m": 0.0, "pitch_error_rad": 0.0}
        flown |= other if i == 1 else {}
        found += [
            Event("apex", None, i + 0.4, i + 0.4, **flown),
            Event("touchdown", ("front", "rear")[i % 2], i + 0.5, i + 0.5 + late_s),
        ]
    return {"compared": EventComparison(tuple(found))}


def late(by: float) -> dict[str, object]:
    """A jump whose landing is late by so much [s]."""
    feet = [Event("touchdown", leg, 0.5, 0.5 + by) for leg in ("front", "rear")]
    return {"touchdown_error_s": by, "compared": EventComparison(tuple(feet))}


SECOND = Event("touchdown", "rear", None, 2.7)
EXTRA = {"compared": EventComparison((*events(0.0, 0.0)["compared"].events, SECOND))}  # type: ignore[attr-defined]
MISSING = {"compared": EventComparison((Event("touchdown", "front", 0.5, None),))}


@pytest.mark.parametrize(
    ("key", "facts", "good", "told"),
    [
        ("replay", {}, True, "re-simulation matches the plan"),
        ("replay", late(-4e-5), True, "re-simulation matches the plan"),
        ("replay", late(1e-3), True,
         "re-simulation matches the plan (touchdown 1.0 ms late, 2 ms allowed)"),
        ("replay", {"final_error_m": 0.029}, True,
         "re-simulation matches the plan (end 29.0 mm away, 30 mm allowed)"),
        ("replay", {"end": STILL}, True, "re-simulation matches the plan"),
        ("replay", {"end": EndError(-6.2, 0.0, 0.0)}, False,
         "the re-simulation ends turned by 6.20 rad (0.15 rad allowed)"),
        ("replay", {"end": EndError(0.0, 0.7, 0.0)}, False,
         "the re-simulation ends with a velocity 0.70 m/s off the plan's (0.3 m/s allowed)"),
        ("replay", {"end": EndError(0.0, 0.0, -2.0)}, False,
         "the re-simulation ends with a pitch rate 2.00 rad/s off the plan's (1.5 rad/s allowed)"),
        ("replay", events(0.0, 0.012), False,
         "the re-simulation touches down with the rear foot 12.0 ms late (2 ms allowed)"),
        ("replay", events(0.0, 0.0, height_error_m=-0.004), False,
         "the re-simulation reaches 4.0 mm below the second planned apex (2 mm allowed)"),
        ("plant_replay", events(0.0, 0.0, x_error_m=-0.07), False,
         "the simulated robot is 70.0 mm behind at the second apex (50 mm allowed)"),
        ("plant_replay", events(0.0, pitch_error_rad=0.0), True,
         "simulated robot matches the plan"),
        ("replay", EXTRA, False, "the re-simulation touches the ground with the rear foot a second "
         "time, at 2.700 s, which is not planned"),
        ("plant_replay", EXTRA, True, "simulated robot matches the plan, but it touches the ground "
         "with the rear foot a second time, at 2.700 s, which is not planned"),
        ("plant_replay", MISSING, False,
         "the simulated robot never touches down with the front foot, planned at 0.500 s"),
        ("replay", {"apex_error_m": -0.0262}, False,
         "the re-simulation reaches 26.2 mm below the planned apex (2 mm allowed)"),
        ("replay", late(0.0174), False,
         "the re-simulation touches down 17.4 ms late (2 ms allowed)"),
        ("replay", {"final_error_m": 0.12, "apex_error_m": 0.003}, False,
         "the re-simulation reaches 3.0 mm above the planned apex (2 mm allowed) and ends 120.0 mm "
         "from the plan (30 mm allowed)"),
        ("plant_replay", {**late(0.003), "apex_error_m": 0.04, "final_error_m": 0.01},
         True, "simulated robot matches the plan (apex 40.0 mm higher, 50 mm allowed)"),
        ("plant_replay", {**late(0.074), "final_error_m": 0.194}, False,
         "the simulated robot touches down 74.0 ms late (25 ms allowed) and ends 194.0 mm from the "
         "plan (50 mm allowed)"),
        ("table_replay", {"apex_error_m": -0.0029}, False,
         "the re-simulation of controller.csv reaches 2.9 mm below the planned apex (2 mm "
         "allowed)"),
        ("table_replay", {**late(-0.021), "final_error_m": 0.031}, False,
         "the re-simulation of controller.csv touches down 21.0 ms early (3 ms allowed) and ends "
         "31.0 mm from the plan (30 mm allowed)"),
        ("plant_replay", {"apex_error_m": -0.06}, False,
         "the simulated robot reaches 60.0 mm below the planned apex (50 mm allowed)"),
        ("plant_replay", FELL, False, "the simulated robot tips over"),
    ],
)  # fmt: skip
def test_a_verdict_says_what_matches_or_what_fails(
    key: str, facts: dict[str, object], good: bool, told: str
) -> None:
    found = judged_as(key, facts)
    assert (found.good, found.sentence) == (good, told)


def judged_as(key: str, facts: dict[str, object], tolerances: Tolerances | None = None) -> Verdict:
    """The verdict on an execution that is `LANDED` but for some facts, of a fall at 1 m/s."""
    allowed = allowances(tolerances or Tolerances(), 1.0)[key]
    done = replace(LANDED, **facts)  # type: ignore[arg-type]
    return judge(EXECUTIONS[key], done, allowed, same_model=key != "plant_replay")


def test_what_cannot_be_started_confirms_nothing() -> None:
    found = judge(EXECUTIONS["replay"], None, allowances(Tolerances(), 1.0)["replay"])
    assert (found.good, found.sentence) == (False, "the re-simulation cannot be started")


@pytest.mark.parametrize(
    ("facts", "share"),
    [({}, 0.005), (late(-0.004), 2.0), (FELL, math.inf)],
)
def test_a_verdict_measures_the_largest_error(facts: dict[str, object], share: float) -> None:
    found = judged_as("replay", facts)
    assert found.share == pytest.approx(share)


def run(plant: float, table: float, good: bool) -> Trial:
    """A plan whose executions miss by these shares of what is allowed."""
    shares = {"replay": 0.0, "table_replay": table, "plant_replay": plant}
    found = {key: Verdict(share <= 1.0, "", share) for key, share in shares.items()}

    status = Status.SOLVED if good else Status.ACCEPTABLE
    plan = SimpleNamespace(status=status, objective=1.0)
    judged = Judged({}, found, None)
    return Trial(plan, {"good": good}, Motions(), judged)  # type: ignore[arg-type]


def test_of_plans_that_fail_the_nearest_is_best() -> None:
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
    assert allowances(Tolerances(), speed)["plant_replay"].touchdown == pytest.approx(late)
    own = allowances(Tolerances(plant_touchdown=0.04), speed)["plant_replay"]
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
