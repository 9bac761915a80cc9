"""What a learnt model rests on: read, checked, and held against a motion."""

from pathlib import Path

import numpy as np
import pytest

from kemba.config import dump_yaml
from kemba.errors import KembaError
from kemba.files import sha256
from kemba.model import Evidence, load_model, load_spec, read_covariance
from kemba.model.evidence import EvidenceLog, Measured, write_covariance

NAMES = ("seal_friction.F_c", "boom_force.F")
EFFECTS = [
    {"kind": "seal_friction", "F_c": 8.0, "support": "sure"},
    {"kind": "boom_force", "F": -6.0, "support": "likely"},
]


def model(folder: Path, matrix: np.ndarray, names: tuple[str, ...] = NAMES) -> Path:
    write_covariance(folder / "covariance.csv", names, matrix)
    evidence = {"error_held_out": 0.9, "covariance": "covariance.csv"}
    dump_yaml({"base": "planning", "effects": EFFECTS, "evidence": evidence}, folder / "model.yaml")
    return folder / "model.yaml"


def test_a_covariance_is_read_back(tmp_path: Path) -> None:
    matrix = np.array([[1.0, 0.3], [0.3, 0.25]])
    names, read = read_covariance(model(tmp_path, matrix))
    assert names == NAMES
    assert np.allclose(read, matrix)


@pytest.mark.parametrize(
    ("matrix", "says"),
    [
        ([[1.0, 0.3], [0.1, 1.0]], "not symmetric"),
        ([[1.0, 2.0], [2.0, 1.0]], "not positive semidefinite"),
        ([[-1.0, 0.0], [0.0, 1.0]], "is negative"),
        ([[1.0, np.nan], [np.nan, 1.0]], "not finite"),
        ([[1.0, 0.0]], "2 names"),
    ],
)
def test_what_is_no_covariance_is_refused(tmp_path: Path, matrix: list, says: str) -> None:
    with pytest.raises(KembaError, match=says) as told:
        read_covariance(model(tmp_path, np.array(matrix)))
    assert "model.yaml:" in str(told.value)


def test_a_covariance_of_other_effects_or_gone_is_refused(tmp_path: Path) -> None:
    path = model(tmp_path, np.eye(2), ("seal_friction.F_c", "hip_friction.tau_c"))
    with pytest.raises(KembaError, match=r"hip_friction\.tau_c"):
        read_covariance(path)
    (tmp_path / "covariance.csv").write_text("a.b\nmuch\n")
    with pytest.raises(KembaError, match="is no covariance"):
        read_covariance(path)
    (tmp_path / "covariance.csv").unlink()
    with pytest.raises(KembaError, match="cannot be read"):
        read_covariance(path)
    with pytest.raises(KembaError, match="has no evidence"):
        read_covariance("planning")


def test_evidence_is_that_of_a_base_only_where_a_model_adds_nothing(tmp_path: Path) -> None:
    model(tmp_path, np.eye(2))
    (tmp_path / "same.yaml").write_text("base: model.yaml\n")
    (tmp_path / "other.yaml").write_text("base: model.yaml\nsupply: 0.65 MPa\n")
    assert load_spec(tmp_path / "same.yaml").evidence is not None
    assert read_covariance(tmp_path / "same.yaml")[0] == NAMES
    assert load_spec(tmp_path / "other.yaml").evidence is None


def test_support_is_a_word_and_no_physics(tmp_path: Path) -> None:
    path = model(tmp_path, np.eye(2))
    found = {e.name: e for e in load_model(path).effects}
    assert (found["seal_friction"].support, found["boom_force"].support) == ("sure", "likely")
    assert "support" not in found["boom_force"].parameters()
    assert "support" not in found["boom_force"].model_dump()
    assert found["boom_force"].listed()["support"] == "likely"


def test_what_was_not_measured_is_said() -> None:
    found = Evidence(measured=Measured(apex=(0.44, 0.5), speed=(1.9, 2.2), modes=("00", "10")))
    assert not found.beyond(apex=0.5, speed=2.0, modes=["00"])
    assert found.beyond(apex=0.55) == [
        "beyond what was measured: apex 0.55 m, the logs have 0.44 to 0.5 m"
    ]
    assert not found.beyond(apex=0.4, speed=1.0), "every log has lower and slower places"
    assert found.beyond(speed=2.249)[0].endswith("speed 2.25 m/s, the logs have 1.9 to 2.2 m/s")
    assert "valve mode 11" in found.beyond(modes=["11"])[0]
    assert not Evidence().beyond(apex=9.0)


def test_logs_that_are_gone_or_changed_are_said(tmp_path: Path) -> None:
    one, two = tmp_path / "one.csv", tmp_path / "two.csv"
    for file in (one, two):
        file.write_text("time [s]\n0\n")
    logs = tuple(EvidenceLog.of(file, tmp_path, "learnt") for file in (one, two))
    found = Evidence(logs=logs)
    assert logs[0].sha256 == sha256(one)
    assert not found.faults(tmp_path)
    one.write_text("time [s]\n1\n")
    two.unlink()
    (sentence,) = found.faults(tmp_path)
    assert "one.csv has changed" in sentence
    assert "two.csv is gone" in sentence
