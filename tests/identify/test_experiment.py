"""The next test is the one that separates the rivals."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from kemba.config import load_yaml
from kemba.errors import KembaError
from kemba.identify.experiment import contenders, propose


def answer(folder: Path, *rows: tuple[str, str, float]) -> Path:
    """An answer folder whose ranking leaves doubt."""
    ranking = [
        {"effect": e, "probability": 0.4, "parameters": {p: {"value": v}}, "equivalent_to": []}
        for e, p, v in rows
    ]
    ranking[0]["equivalent_to"] = [row[0] for row in rows[1:]]
    (folder / "answer.json").write_text(json.dumps({"ranking": ranking, "base": "planning"}))
    return folder


def test_a_moving_test_separates_friction_from_damping(tmp_path: Path) -> None:
    folder = answer(tmp_path, ("seal_friction", "F_c", 8.0), ("piston_damping", "c", 30.0))
    found = propose(folder, tmp_path / "next.yaml")
    assert "locked" not in found.rig.name
    assert found.nats > 100
    written = load_yaml(tmp_path / "next.yaml").data["rig"]
    assert written["kind"] in ("dynamometer", "random") and "seal_friction" in written["notes"]


def test_a_late_sensor_and_a_late_valve_need_motion(tmp_path: Path) -> None:
    rows = (("valve_delay", "dt", 0.002), ("sensor_delay:piston/F", "dt", 0.002))
    found = propose(answer(tmp_path, *rows), tmp_path / "next.yaml")
    assert "locked" not in found.rig.name


def test_without_rivals_there_is_nothing_to_separate(tmp_path: Path) -> None:
    folder = answer(tmp_path, ("hip_friction", "T_c", 0.6), ("hip_damping", "b", 0.1))
    with pytest.raises(KembaError, match="no rig test"):
        propose(folder, tmp_path / "next.yaml")
    with pytest.raises(KembaError, match="no ranking"):
        contenders({"ranking": []})
