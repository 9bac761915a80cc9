"""The pieces of a round: flights, corrections, rounds, aimed tables."""

import json
from dataclasses import replace
from math import inf
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from kemba.config import dump_yaml, load_yaml
from kemba.errors import KembaError
from kemba.identify.answer import Answer
from kemba.model import load_model
from kemba.model.evidence import write_covariance
from kemba.model.spec import drawn_models
from kemba.ocp import load_task
from kemba.plant.retiming import FALLEN
from kemba.plotting.source import load_machine
from kemba.rounds.correction import (
    TURNED,
    Aim,
    Correction,
    CorrectionSettings,
    FlownJump,
    correction_from,
    flight_of,
    scatter_of,
    write_correction,
)
from kemba.rounds.outcome import ExpectedApex, band_about
from kemba.rounds.page import verdict_of
from kemba.rounds.round import Round, as_executed, entry, past_of
from kemba.trajectory import Trajectory


def ballistic(noise: float = 0.0, pitch: float = 0.0) -> Trajectory:
    """A rigid robot that is thrown up from its feet at 2 m/s and ends where it began."""
    machine = load_machine()
    stance = dict(machine.mechanism.standing)
    time = np.arange(0.0, 0.6, 1e-3)
    rise = np.clip(2.0 * (time - 0.05) - 4.905 * (time - 0.05) ** 2, 0.0, None)
    rise[time < 0.05] = 0.0
    rng = np.random.default_rng(0)
    columns = {"body/z [m]": stance["body/z"] + rise + noise * rng.normal(size=len(time)),
               "body/pitch [rad]": pitch * time}  # fmt: skip
    for leg in machine.mechanism.legs:
        columns[f"{leg}/hip/q [rad]"] = np.full(len(time), stance[f"{leg}/hip/q"])
        columns[f"{leg}/knee/q [rad]"] = np.full(len(time), stance[f"{leg}/knee/q"])
    return Trajectory(time, columns)


def test_apex_and_touchdown_of_a_throw() -> None:
    found = flight_of(ballistic(), load_machine())
    height = load_machine().mechanism.standing["body/z"] + 2.0**2 / (2 * 9.81)
    assert found.apex == pytest.approx(height, abs=1e-5)
    assert found.touchdown == pytest.approx(0.05 + 4.0 / 9.81, abs=2.5e-3)


def test_noise_hardly_moves_the_apex() -> None:
    clean, noisy = (flight_of(ballistic(n), load_machine()) for n in (0.0, 3e-4))
    assert abs(noisy.apex - clean.apex) < 2e-4


def flights(errors: list[float]) -> list[FlownJump]:
    return [FlownJump(0.5 + e, 0.5, 0.0) for e in errors]


def test_what_repeats_is_corrected_and_scatter_is_not() -> None:
    simulated = FlownJump(0.5, 0.5, 0.0)
    assert correction_from(flights([0.02, 0.021, 0.019]), simulated).apex == pytest.approx(
        0.02, rel=0.01
    )
    chance = correction_from(flights([0.004, -0.004, 0.001]), simulated).apex
    assert abs(chance) < 1e-4
    one = correction_from(flights([0.003]), simulated).apex
    assert one == pytest.approx(0.0015, rel=1e-6), "one error as large as the scatter counts half"


def test_the_correction_is_bounded() -> None:
    far = correction_from(flights([0.2, 0.2, 0.2]), FlownJump(0.5, 0.5, 0.0))
    assert far.apex == pytest.approx(0.05) and far.limited == ("apex",)


def test_no_touchdown_corrects_none() -> None:
    up = [FlownJump(0.5, float("nan"), float("nan"))]
    found = correction_from(up, FlownJump(0.5, 0.5, 0.0))
    assert found.touchdown == 0.0


def test_the_correction_has_a_file_of_its_own(tmp_path: Path) -> None:
    file = tmp_path / "correction.yaml"
    write_correction(file, Correction(apex=0.01, logs=3), {"front/valve/extend": [1, -2]}, {})
    data = load_yaml(file).data
    assert data["unexplained"]["apex"] == 0.01 and "no physics" in data["note"]
    assert data["edges_moved_ms"] == {"front/valve/extend": [1, -2]}


def made(folder: Path, pulse: float, manifest: dict[str, object] | None = None) -> Path:
    """A run folder with a table that opens one valve until `pulse` [s]."""
    folder.mkdir()
    time = np.arange(-6, 194) / 1000.0
    columns = {"front/valve/extend [1]": ((time >= 0.0) & (time < pulse)) * 1.0}
    Trajectory(time, columns, {"lead": 0.006}).write(folder / "controller.csv")
    (folder / "manifest.json").write_text(json.dumps({"status": "solved", **(manifest or {})}))
    return folder


def logged(run: Path, name: str, begin: float = -0.006) -> Trajectory:
    """A log whose first row has the time `begin` [s]."""
    table = Trajectory.read(run / "controller.csv")
    time = np.arange(-0.006, 0.189, 1.03e-3)
    valve = table.held("front/valve/extend", time)
    log = Trajectory(time - time[0] + begin, {"front/valve/extend [1]": valve})
    log.write(run / name)
    log.meta["path"] = str(run / name)
    return log


def test_rounds_are_counted_from_the_run_folders(tmp_path: Path) -> None:
    first = made(tmp_path / "first", 0.05)
    past = past_of([first], [logged(first, "a.csv")])
    assert (past.round, past.last, past.history) == (1, 0, [])
    facts = entry(past, {"executed_apex_error_m": 0.01})
    second = made(tmp_path / "second", 0.10, facts)
    logs = [logged(second, "b.csv"), logged(first, "c.csv")]
    past = past_of([second, first], logs)
    assert past.round == 2
    assert [run.path.name for run in past.runs] == ["first", "second"]
    assert past.last == 1 and [len(past.executed[i]) for i in (0, 1)] == [1, 1]
    assert {p.name for p in past.logs} == {"a.csv", "b.csv", "c.csv"}, "earlier logs join in"
    assert [e["round"] for e in past.history] == [1]


@pytest.mark.parametrize("begin", [-0.006, 0.0])
def test_logs_are_put_on_the_clock_of_the_plan(tmp_path: Path, begin: float) -> None:
    first = made(tmp_path / "first", 0.05)
    (log,) = past_of([first], [logged(first, "a.csv", begin)]).executed[0]
    assert log.time[0] == pytest.approx(-0.006)


def test_a_log_of_no_run_is_refused(tmp_path: Path) -> None:
    first, other = made(tmp_path / "first", 0.05), made(tmp_path / "other", 0.15)
    with pytest.raises(KembaError, match="valve commands differ"):
        past_of([first], [logged(other, "a.csv")])


def test_what_was_learnt_from_judges_nothing(tmp_path: Path) -> None:
    first = made(tmp_path / "first", 0.05)
    log = logged(first, "a.csv")
    with pytest.raises(KembaError, match="already learnt from"):
        past_of([first], [log], [first / "a.csv"])
    facts = entry(past_of([first], [log]), {})
    second = made(tmp_path / "second", 0.10, facts)
    copy = tmp_path / "renamed.csv"
    copy.write_bytes((first / "a.csv").read_bytes())
    with pytest.raises(KembaError, match="already learnt from"):
        past_of([second], [logged(second, "b.csv")], [copy])


def test_models_have_the_supply_and_payload_of_the_run(tmp_path: Path) -> None:
    task, _ = load_task("jump", ["supply=0.65 MPa", "payload=0.3 kg"])
    name = as_executed("planning", task, tmp_path / "run.yaml")
    built = load_model(name)
    assert built.supply == pytest.approx(0.65e6)
    assert built.effect("payload").value("m") == pytest.approx(0.3)
    plain, _ = load_task("jump", [])
    assert as_executed("planning", plain, tmp_path / "no.yaml") == "planning"


SIMULATED = FlownJump(0.491, 0.5, 0.0)
BAND = ExpectedApex(0.4995, 0.496, 0.503)


def a_round(verdict: str, added: list[str], good: bool, after: float = 1.2) -> Round:
    """A round with these results, of one jump that stayed 9 mm too low."""
    planned, executed = (FlownJump(z, 0.5, 0.0) for z in (0.5, 0.491))
    answer = Answer("unknown", sentence="")
    answer.verdict, answer.added = verdict, added  # type: ignore[assignment]
    result = {"confirmed": good, "sentence": "FAILED: the simulated robot tips over."}
    past = SimpleNamespace(round=2)
    flown = (planned, [executed], SIMULATED, planned)
    return Round(past, "m.yaml", answer, 3.0, after, *flown, result=result)  # type: ignore


@pytest.mark.parametrize(
    ("verdict", "added", "good", "after", "grade", "told"),
    [
        (
            "missing", ["a", "b"], True, 1.2, "good",
            "Round 2: the robot jumped 9.0 mm lower than planned. The model lacks a and b; with "
            "them its error goes from 3.00 to 1.20 times the noise.",
        ),
        (
            "partly", ["a"], True, 1.2, "fair",
            "Round 2: the robot jumped 9.0 mm lower than planned. The model lacks a, and something "
            "more that is not known; with it its error goes from 3.00 to 1.20 times the noise.",
        ),
        (
            "missing", ["a"], True, 3.1, "good",
            "Round 2: the robot jumped 9.0 mm lower than planned. With a added its error goes from "
            "3.00 to 3.10 times the noise: the model stays as it is.",
        ),
        (
            "nothing", [], False, 3.0, "bad",
            "FAILED: the next plan is not confirmed: the simulated robot tips over. Round 2: the "
            "robot jumped 9.0 mm lower than planned. The model lacks nothing that these logs show.",
        ),
    ],
)  # fmt: skip
def test_a_round_is_told_in_plain_words(
    verdict: str, added: list[str], good: bool, after: float, grade: str, told: str
) -> None:
    found = a_round(verdict, added, good, after)
    said = verdict_of(found, Path("runs/jump-2"))
    assert (said.grade, said.sentence) == (grade, told)
    verb = "report" if grade == "bad" else "simulate"
    assert said.command.startswith(f"kemba-opt {verb} runs/jump-2")


def test_a_round_says_whether_the_executed_apex_was_expected() -> None:
    found = replace(a_round("nothing", [], True), was_expected=BAND, next_expected=BAND)
    found = replace(found, target=FlownJump(0.5, 0.5, 0.0))
    assert "its apex of 0.4910 m lay outside what was expected, 0.4960 to 0.5030" in found.sentence
    assert "The next run is expected to reach 0.4995 m (0.4960 to 0.5030 m)" in found.sentence
    assert found.json()["inside"] is False
    assert ExpectedApex.of(found.json()["next_expected"]) == BAND
    assert ExpectedApex.of(None) is None is ExpectedApex.of({"apex_m": 1.0})


def test_models_are_drawn_from_the_covariance_within_their_bounds(tmp_path: Path) -> None:
    write_covariance(tmp_path / "c.csv", ["seal_friction.F_c", "boom_force.F"], np.diag([4.0, 1.0]))
    effects = [{"kind": "seal_friction", "F_c": 1.0}, {"kind": "boom_force", "F": -6.0}]
    path = tmp_path / "model.yaml"
    dump_yaml({"base": "planning", "effects": effects, "evidence": {"covariance": "c.csv"}}, path)
    drawn = drawn_models(load_model(path), str(path), 200)
    friction = np.array([m.effect("seal_friction").value("F_c") for m in drawn])
    force = np.array([m.effect("boom_force").value("F") for m in drawn])
    assert friction.min() == 0.0 and friction.std() > 0.9
    assert force.mean() == pytest.approx(-6.0, abs=0.3) and force.std() == pytest.approx(1, abs=0.2)


def test_a_covariance_that_is_gone_is_said_and_ends_no_round(tmp_path: Path) -> None:
    path, table = tmp_path / "model.yaml", Trajectory(np.arange(3.0), {})
    dump_yaml({"base": "planning", "effects": [{"kind": "boom_force", "F": -6.0}],
               "evidence": {"covariance": "gone.csv"}}, path)  # fmt: skip
    band, said = band_about(0.5, table, load_model(path), str(path), load_machine(), 0.0, 1e-3)
    assert "gone.csv: cannot be read" in said[0]
    assert band.high - band.low == pytest.approx(2 * 1.96e-3)


def test_scatter_counts_what_is_usual_once() -> None:
    usual = CorrectionSettings.apex_scatter
    assert scatter_of(flights([0.0])) == pytest.approx(usual)
    assert scatter_of(flights([0.001, -0.001, 0.0])) < usual
    assert scatter_of(flights([0.02, -0.02, 0.0])) > 2.0 * usual


@pytest.mark.parametrize(
    ("flown", "lands", "moved", "error"),
    [
        (FlownJump(0.5, 0.3, 0.0), True, 0, 0.0),
        (FlownJump(0.501, 0.3, 0.0), True, 8, 2.0),
        (FlownJump(0.5, 0.3, 0.0), True, 9, FALLEN),
        (FlownJump(0.5, 0.3, 0.0), False, 0, FALLEN),
        (FlownJump(0.5, inf, 0.0), True, 0, FALLEN),
        (FlownJump(0.501, 0.3, 0.02), True, 0, 2.0 + TURNED),
    ],
)
def test_a_corrected_table_that_falls_or_is_far_is_none(
    flown: FlownJump, lands: bool, moved: int, error: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The apex counts in half millimetres; one that must land and does not has fallen."""
    monkeypatch.setattr("kemba.rounds.correction._moved", lambda *_: {"edge": [-moved]})
    aim: Any = SimpleNamespace(expected=lambda *_: (flown, lands))
    table, wanted = Trajectory(np.arange(2.0), {}), FlownJump(0.5, 0.3, 0.0)
    found = Aim._tried(aim, table, table, 0.0, wanted, turn=0.01, must=True)
    assert found.error == pytest.approx(error)


def test_earlier_logs_that_are_gone_or_changed_are_said(tmp_path: Path) -> None:
    first = made(tmp_path / "first", 0.05)
    past = past_of([first], [logged(first, "a.csv"), logged(first, "c.csv")])
    second = made(tmp_path / "second", 0.10, entry(past, {}))
    (first / "a.csv").unlink()
    with (first / "c.csv").open("a") as stream:
        stream.write("9,0\n")
    past = past_of([second], [logged(second, "b.csv")])
    assert [p.name for p in past.logs] == ["b.csv"]
    gone, changed = past.remarks
    assert "a.csv of an earlier round is gone" in gone
    assert "c.csv has changed" in changed
