"""Figures of a rig stay where a model can have them, and those that cannot be told are refused."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "rigs"))

from machines import drive_log, model_file

from kemba.errors import KembaError
from kemba.identify.logs.gate import BadData
from kemba.identify.rigs import characterise
from kemba.identify.workflow import compare_logs
from kemba.model import load_model
from kemba.trajectory import Trajectory

DRIVE = {"kind": "drive", "motion": "linear", "inertia": "2 kg"}


def test_bounds_are_factors_of_the_declared_ones(tmp_path: Path) -> None:
    model = load_model(model_file(tmp_path, DRIVE, {"kind": "axis_friction", "F_c": "4 N"}))
    declared = model.parameters["axis_friction.F_c"][0]
    low, high = characterise._bounds(model, ["axis_friction.F_c"], {"axis_friction.F_c": 4.0}, 1)
    assert low.tolist() == [declared.lower / 4.0 - 1.0, -np.inf]
    assert high.tolist() == [declared.upper / 4.0 - 1.0, np.inf]


def test_figures_that_cannot_be_told_apart_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where what is left of one, beside the others, is below what counts as none."""
    log = drive_log(tmp_path / "a.csv", seconds=2.0)
    model = model_file(tmp_path, DRIVE, {"kind": "axis_friction"}, {"kind": "axis_damping"})
    monkeypatch.setattr(characterise, "FLAT", 2.0)
    with pytest.raises(KembaError, match="cannot be told from the other figures") as told:
        characterise.characterise_logs([log], model)
    assert told.value.where in ("axis_friction.F_c", "axis_damping.F_v")


def test_logs_that_compare_refuses_are_refused_in_its_words(tmp_path: Path) -> None:
    """A force counted the other way, which friction fitted to it would hide."""
    right = Trajectory.read(drive_log(tmp_path / "a.csv", seconds=2.0))
    turned = {"axis/q [m]": right["axis/q"], "axis/tau [N]": -right["axis/tau"]}
    Trajectory(right.time, turned).write(tmp_path / "b.csv")
    model = model_file(tmp_path, DRIVE, {"kind": "axis_friction"})
    said = []
    for read in (characterise.characterise_logs, compare_logs):
        with pytest.raises(BadData) as refused:
            read([tmp_path / "b.csv"], model)
        said.append(str(refused.value))
    assert "axis/tau has the reversed sign" in said[0] and said[0] == said[1]
