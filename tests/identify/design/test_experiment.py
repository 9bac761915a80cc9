"""The next test is designed for the rivals, and tells them apart on the twin as well."""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from unittest.mock import patch

import pytest
from rehearsal import FIRST, Machine, fitted, measured_evidence, problem_of
from typer.testing import CliRunner

from kemba.errors import KembaError
from kemba.identify.design.rig import design_rig_test, propose
from kemba.identify.design.separation import DesignSearchSettings, ExperimentSettings, contenders
from kemba.model.spec import load_model
from kemba.plant.rigs import load_rig
from kemba_cli.main import app


@pytest.fixture
def short_search() -> Iterator[None]:
    """A search that tries few short tests, however long that takes, and looks at one test of each
    rig only."""
    few = patch.multiple(DesignSearchSettings, members=6, generations=1, budget=math.inf)
    with (
        few,
        patch.multiple(ExperimentSettings, tests=1),
        patch("kemba.identify.design.rig.LONGEST", 0.8),
    ):
        yield


def answer(folder: Path, *rows: tuple[str, str, float], added: tuple[str, ...] = ()) -> Path:
    """An answer folder whose ranking leaves doubt."""
    ranking = [
        {"effect": e, "probability": 0.4, "parameters": {p: {"value": v}}, "equivalent_to": []}
        for e, p, v in rows
    ]
    rivals = [row for row in ranking if row["effect"] not in added[1:]]
    rivals[0]["equivalent_to"] = [row["effect"] for row in rivals[1:]]
    text = json.dumps({"ranking": ranking, "base": "planning", "added": added})
    (folder / "answer.json").write_text(text)
    return folder


def test_the_designed_test_is_short_and_better_per_second(
    tmp_path: Path, short_search: None
) -> None:
    """It separates friction from damping in half the log time of the best standard test."""
    folder = answer(tmp_path, ("seal_friction", "F_c", 8.0), ("piston_damping", "c", 30.0))
    told: list[str] = []
    found = propose(folder, tmp_path / "next.yaml", told.append)
    standard, designed = found.standard, found.designed
    assert found.chosen is designed and found.nats > 5 and "decisive" in found.sentence
    assert designed.log_s <= min(2.0, 0.5 * standard.log_s) and designed.pace > standard.pace
    assert "locked" not in standard.test.name  # a rod at rest shows neither
    assert load_rig(tmp_path / "next.yaml").notes == found.sentence
    assert any("tests tried" in text for text in told)
    facts = found.json()
    assert facts["nats"] == facts["designed"]["nats"] and facts["rivals"][1] == "piston_damping"


def test_late_valves_are_told_from_a_late_sensor(tmp_path: Path, short_search: None) -> None:
    """Tests are looked for at half the rows of a log, but their valves switch when they say."""
    rows = ("valve_delay", "dt", 0.002), ("sensor_delay:piston/F", "dt", 0.002)
    found = propose(answer(tmp_path, *rows), tmp_path / "next.yaml")
    assert found.nats > 5


@pytest.mark.slow
def test_the_verb_writes_the_test_and_says_what_to_type(
    tmp_path: Path, short_search: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "answer").mkdir()
    answer(tmp_path / "answer", ("seal_friction", "F_c", 8.0), ("piston_damping", "c", 30.0))
    done = CliRunner().invoke(app, ["experiment", "answer"])
    assert done.exit_code == 0, done.stderr
    assert done.stdout == "answer/experiment.yaml\n"
    assert done.stderr.endswith("next: kemba-opt simulate answer/experiment.yaml --noise\n")
    assert load_rig(tmp_path / "answer" / "experiment.yaml").notes in done.stderr


def test_the_verb_says_what_is_wrong_with_an_answer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(app, ["experiment", "answer"])
    assert done.exit_code == 2 and "answer.json" in done.stderr
    assert not (tmp_path / "answer").exists()
    (tmp_path / "answer").mkdir()
    answer(tmp_path / "answer", ("hip_friction", "T_c", 0.6), ("hip_damping", "b", 0.1))
    done = CliRunner().invoke(app, ["experiment", "answer"])
    assert done.exit_code == 2 and "no rig test shows a difference" in done.stderr


def test_effects_without_doubt_are_no_rivals() -> None:
    """What the answer holds beside the doubtful effect is there whichever rival it is."""
    row = {"probability": 1.0, "equivalent_to": []}
    sure = {"effect": "payload", "parameters": {"m": {"value": 1.0}}, **row}
    doubtful = {"effect": "valve_delay", "parameters": {"dt": {"value": 0.002}}, **row}
    rival = {"effect": "hose_lag", "parameters": {"tau": {"value": 0.003}}, **row}
    doubtful["equivalent_to"] = ["hose_lag"]
    data = {"ranking": [sure, doubtful, rival], "added": ["payload", "valve_delay"]}
    found = contenders(data)
    assert found.names == ("valve_delay", "hose_lag") and found.shared == {"payload.m": 1.0}
    assert found.theta("hose_lag") == {"payload.m": 1.0, "hose_lag.tau": 0.003}


def test_without_rivals_there_is_nothing_to_separate(tmp_path: Path) -> None:
    folder = answer(tmp_path, ("hip_friction", "T_c", 0.6), ("hip_damping", "b", 0.1))
    with pytest.raises(KembaError, match="no rig test"):
        propose(folder, tmp_path / "next.yaml")
    with pytest.raises(KembaError, match="no ranking"):
        contenders({"ranking": []})


def test_rigs_of_other_kinds_are_refused(tmp_path: Path) -> None:
    folder = answer(tmp_path, ("coulomb", "F_c", 1.0), ("viscous", "c", 1.0))
    data = json.loads((folder / "answer.json").read_text()) | {"base": "drive_rig"}
    (folder / "answer.json").write_text(json.dumps(data))
    with pytest.raises(KembaError, match="kind drive"):
        propose(folder, tmp_path / "next.yaml")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("truth", "other"),
    [("seal_friction", "piston_damping"), ("cross_leak", "supply_droop")],
)
def test_the_twin_agrees(tmp_path: Path, truth: str, other: str, short_search: None) -> None:
    """A test designed on what a first log leaves in doubt is decisive on the independent twin."""
    model, machine = load_model("planning", rig=True), Machine(truth, seed=31)
    stroke = model.mechanism.stroke
    first = problem_of(machine.done(FIRST, stroke, tmp_path / "first"), model)
    rivals = fitted(first, (truth, other))
    design = design_rig_test(model, rivals)
    assert design is not None
    assert design.designed.log_s <= 0.5 * design.standard.log_s
    logs = machine.done(design.designed.test, stroke, tmp_path / "next")
    assert measured_evidence(problem_of(logs, model), rivals, truth, other) > 5.0
