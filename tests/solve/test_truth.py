"""Whose verdict counts: a model that was learnt from logs outranks the simulated robot."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kemba.config import dump_yaml
from kemba.files import sha256
from kemba.mechanism.robot_file import robot_files
from kemba.model import load_spec
from kemba.model.evidence import write_covariance
from kemba.ocp import load_task
from kemba.plant.repeat import carried_over, counterpart, lacking
from kemba.solve import Approach, Listener, best_plan
from kemba.solve.trial import Trial
from kemba.solve.truth import truth_of

WEAK = {"kind": "supply_scale", "k": 0.9, "support": "sure"}


def learnt(folder: Path, covariance: bool = True, **evidence: Any) -> Path:
    """A model that logs say pushes 10 % less, with its evidence."""
    (folder / "log.csv").write_text("time [s]\n0\n", encoding="utf-8")
    robot = sha256(robot_files(str(load_spec("planning").robot))[0])
    logs = [{"file": "log.csv", "sha256": sha256(folder / "log.csv"), "use": "quoted"}]
    measured = {"apex": [0.44, 0.52], "speed": [1.0, 2.5], "supply": [7e5, 7e5], "robot": robot}
    told = {
        "logs": logs,
        "error_held_out": 0.9,
        "error_plant": 2.1,
        "measured": measured,
        **evidence,
    }
    if covariance:
        told["covariance"] = "covariance.csv"
        write_covariance(folder / "covariance.csv", ["supply_scale.k"], np.array([[1e-5]]))
    dump_yaml({"base": "planning", "effects": [WEAK], "evidence": told}, folder / "learnt.yaml")
    return folder / "learnt.yaml"


def solved(model: Path, *options: str) -> Trial:
    task, document = load_task("jump.yaml", [f"model={model}", *options])
    return best_plan(task, document, Approach(), Listener())


def truth(model: Path, *options: str) -> tuple[str, str]:
    found = truth_of(load_task("jump.yaml", [f"model={model}", *options])[0])
    return found.on, " ".join(found.remarks)


def test_evidence_decides_whose_verdict_counts(tmp_path: Path) -> None:
    assert truth(Path("planning")) == ("plant", "")
    model = learnt(tmp_path)
    assert truth(model) == ("learnt model", "")
    on, said = truth(model, "effects.supply_scale.k=0.95")
    assert on == "plant" and "`effects.supply_scale`, which was learnt" in said
    on, said = truth(model, "effects.contact.mu=0.8")
    assert on == "learnt model" and "no log was taken with `effects.contact`" in said
    refitted = learnt(tmp_path, figures={"boom.mass": 1.1})
    assert truth(refitted, "effects.boom.mass=1 kg")[0] == "plant"
    (tmp_path / "log.csv").unlink()
    on, said = truth(model)
    assert on == "learnt model" and "log.csv is gone" in said


def test_a_plant_that_explains_the_logs_better_decides(tmp_path: Path) -> None:
    on, said = truth(learnt(tmp_path, error_plant=0.8))
    assert on == "plant" and "explains the logs better (0.80 times the noise)" in said


def test_another_robot_than_that_of_the_logs_is_said(tmp_path: Path) -> None:
    on, said = truth(learnt(tmp_path, measured={"robot": "0" * 64}))
    assert on == "plant" and "the robot's file has changed since the logs were taken" in said


def test_the_plants_verdict_is_information_beside_a_learnt_model(tmp_path: Path) -> None:
    found = solved(learnt(tmp_path), "tolerances.plant_touchdown=1 ms")
    assert found.good, found.result["sentence"]
    assert not found.judged.verdicts["plant_replay"].good  # type: ignore[union-attr]
    told = found.result["sentence"]
    assert told.startswith("solved: ") and "which is information only" in told
    assert found.result["verdict_on"] == "learnt model"
    band = found.result["band"]
    assert band["n"] == band["landed"] == 40
    assert 0.0 < band["apex_high_m"] - band["apex_low_m"] < 0.05
    assert "expected apex" in told


@pytest.mark.slow
def test_what_lies_beyond_the_logs_and_a_missing_spread_are_said(tmp_path: Path) -> None:
    model = learnt(tmp_path, covariance=False, measured={"apex": [0.3, 0.4]})
    told = solved(model).result["sentence"]
    assert "beyond what was measured: apex 0.5 m" in told
    assert "how sure the plan is cannot be said" in told


@pytest.mark.parametrize("name", ["boom", "end_stop"])
def test_the_plant_has_the_mechanism_of_the_model(tmp_path: Path, name: str) -> None:
    spec = load_spec("planning")
    listed = [e.listed() for e in spec.effects if e.name != name]
    path = tmp_path / "without.yaml"
    dump_yaml({"robot": "kemba", "chambers": "first_order", "effects": listed}, path)
    plant = counterpart(str(path))
    assert name not in {e.name for e in plant.effects}
    assert name in {e.name for e in counterpart("planning").effects}
    assert lacking(str(path), "plant") == [name] and lacking("planning", "plant") == []


def test_what_the_plant_has_of_the_plan_is_said(tmp_path: Path) -> None:
    path = tmp_path / "longer.yaml"
    found = [
        {"kind": "geometry", "part": "femur/length", "d": "3 mm"},
        {"kind": "sensor_bias", "channel": "body/z"},
    ]
    dump_yaml({"base": "planning", "effects": found}, path)
    assert carried_over(str(path), payload=0.5) == ["geometry:femur/length", "payload 0.5 kg"]
    assert carried_over("planning") == carried_over("orifice") == []  # the plant's own air


def test_what_was_learnt_replaces_the_plants_own_figure(tmp_path: Path) -> None:
    seal = {"kind": "seal_friction", "F_c": 12.0}
    for support, force in (({"support": "likely"}, 12.0), ({}, 5.0)):
        path = tmp_path / "seal.yaml"
        dump_yaml({"base": "planning", "effects": [seal | support]}, path)
        assert counterpart(str(path)).effect("seal_friction").value("F_c") == force
