"""The next motion of a robot: a safe sway, judged by the filter, confirmed on the twin."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from rehearsal import measured_evidence
from twin.cases import robot_case
from twin.scripts import from_table

from kemba.config import Document
from kemba.errors import KembaError
from kemba.identify.design.robot import (
    ROWS,
    MotionProposal,
    Sway,
    controller,
    propose_motion,
    safe,
    task,
)
from kemba.identify.design.separation import Rivals
from kemba.identify.logs.reading import read_logs
from kemba.identify.robot.problem import robot_problem
from kemba.model.spec import load_model
from kemba.ocp import Task
from kemba.ocp.planning import check_feasible
from kemba.plant.controller import execute

SWAY = Sway(angle=0.06, leans=4, duration=0.8, pace=1.2)


def test_a_sway_rests_at_every_turn_and_becomes_slower() -> None:
    angle, rate = SWAY.lean(np.array([0.0, *SWAY.ends]))
    assert angle == pytest.approx([0.0, 0.06, -0.06, 0.06, -0.06, 0.0])
    assert rate == pytest.approx(np.zeros(6), abs=1e-9)
    assert np.all(np.diff(SWAY.ends, n=2)[:2] > 0) and SWAY.ends[-1] == pytest.approx(0.8)
    times = np.linspace(0.0, 0.8, 4001)
    angle, rate = SWAY.lean(times)
    assert np.gradient(angle, times) == pytest.approx(rate, abs=0.02)


def test_a_sway_is_safe_and_makes_a_task_without_mistakes() -> None:
    """The simulated robot keeps its feet; a far and fast lean is refused."""
    model = load_model("planning")
    done = execute(controller(model, SWAY), model).trajectory
    assert safe(model, done) and done["body/x"].max() > 0.005
    asked = task(model, "planning", SWAY, done, "")
    assert len(asked["goals"]) == 4
    check_feasible(Task.model_validate(asked), Document(asked))
    wild = Sway(angle=0.6, leans=4, duration=0.5, pace=1.0)
    assert not safe(model, execute(controller(model, wild), model).trajectory)


def test_a_robot_on_one_leg_is_refused(tmp_path: Path) -> None:
    row = {"effect": "hip_friction", "equivalent_to": [], "parameters": {"T_c": {"value": 0.6}}}
    (tmp_path / "answer.json").write_text(json.dumps({"ranking": [row], "base": "monoped"}))
    with pytest.raises(KembaError, match="one leg"):
        propose_motion(tmp_path, tmp_path / "next.yaml")


@pytest.mark.slow
def test_the_twin_agrees_on_a_hip(tmp_path: Path) -> None:
    """Three runs of the designed sway tell friction of the hips from damping on the twin."""
    rows = [
        {"effect": e, "equivalent_to": [], "parameters": {p: {"value": v}}}
        for e, p, v in (("hip_friction", "T_c", 0.9), ("hip_damping", "b", 0.3))
    ]
    (tmp_path / "answer.json").write_text(json.dumps({"ranking": rows, "base": "planning"}))
    with patch("kemba.identify.design.robot.TRIED", 4):
        found = propose_motion(tmp_path, tmp_path / "next.yaml")
    assert found.nats >= found.standard.least and found.nats > 1.0
    table = tmp_path / "controller.csv"
    controller(found.model, found.designed.test).write(table)
    hidden = {"kind": "hip_friction", "parameters": {"T_c": 0.9}}
    script = from_table(table, "sway")
    paths, _ = robot_case(tmp_path / "logs", hidden, seed=5, runs=3, scripts=[script])
    problem = robot_problem(read_logs(paths), load_model())
    rivals: Rivals = found.rivals
    assert measured_evidence(problem, rivals, "hip_friction", "hip_damping") > 5.0


def test_the_evidence_of_a_run_is_that_of_rows_as_were_designed_for() -> None:
    """500 rows per second, as of the proposals that it is compared with."""
    proposal: Any = SimpleNamespace(model="model", rivals="rivals")
    asked = {}

    def done(run: str, model: str, **named: float) -> Any:
        asked.update(named)
        return SimpleNamespace(trajectory=run)

    where = "kemba.identify.design.robot"
    least = SimpleNamespace(least=3.0)
    with patch(f"{where}.execute", done), patch(f"{where}.expected", lambda *_: least):
        assert MotionProposal.nats_of(proposal, "run") == 3.0
    assert asked == {"sample": 1.0 / ROWS}
