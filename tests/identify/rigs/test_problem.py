"""What a rig's model lacks, and the period of a cogging axis, are read from numbers that are
known."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from kemba.config import dump_yaml
from kemba.identify.infer.search import Search
from kemba.identify.rigs.problem import RigProblem, _strongest_period, rig_problem
from kemba.identify.workflow import discover_logs
from kemba.model import load_model
from kemba.trajectory import Trajectory


def test_what_a_model_lacks_is_noise_of_all_rows() -> None:
    """Gaps of 3 N to both sides beside 1 N of the sensors: 8 N2 more, whatever their sign."""
    gap = np.array([3.0, -3.0, 3.0, -3.0])
    predictor = SimpleNamespace(
        gap=lambda log, theta: gap, variance=lambda log, usual: np.ones(len(gap))
    )
    coarse = SimpleNamespace()
    problem: Any = SimpleNamespace(
        logs=[None], usual=1.0, predictor=predictor, recolour=lambda _: coarse
    )
    assert RigProblem.coarser(problem, {}) is coarse
    assert coarse._sigma[0] == pytest.approx(np.full(4, 3.0))


@pytest.mark.parametrize("phase", [0.4, 2.5, 4.0])
def test_the_strongest_period_has_its_phase(phase: float) -> None:
    """A sine of the position, beside inertia, friction and an offset."""
    t = np.linspace(0.0, 20.0, 4000)
    q, v, a = np.sin(t), np.cos(t), -np.sin(t)
    wave = 2.0 * np.sin(2 * np.pi * q / 0.1 + phase)
    force = wave + 3.0 * a + 0.5 * v + 4.0 * np.sign(v) + 1.0
    log: Any = SimpleNamespace(q=q, v=v, a=a, rows=slice(None), doubt=np.zeros(len(t)))
    predictor: Any = SimpleNamespace(gap=lambda log, theta: -force)
    period, found = _strongest_period(predictor, (log,))
    assert period == pytest.approx(0.1, rel=0.03)
    # the period is one of a grid: over the travel from -1 to 1 its phase is off where q is not 0
    assert found == pytest.approx(phase, abs=0.2)


def swung(step: float = 1e-4) -> Trajectory:
    """An axis that swings, read in steps."""
    t = np.arange(0.0, 6.0, 2e-3)
    q, noise = 0.6 * np.sin(2.0 * t), np.random.default_rng(0).standard_normal(len(t))
    columns = {"axis/q [rad]": step * np.round(q / step), "axis/tau [N.m]": q + 0.01 * noise}
    return Trajectory(t, columns, {"kind": "drive", "name": "log"})


@pytest.mark.parametrize("hangs", [True, False])
def test_cogging_of_one_period_a_turn_is_the_weight_that_hangs(hangs: bool, tmp_path: Path) -> None:
    rig: dict[str, Any] = {"kind": "drive", "motion": "rotary", "inertia": "0.1 kg.m2"}
    rig |= {"load": {"mass": "1 kg", "arm": "0.25 m"}} if hangs else {}
    dump_yaml({"rig": rig}, tmp_path / "model.yaml")
    log = swung()
    log.columns["axis/q [rad]"][:] *= 10.0  # several turns
    found = rig_problem([log], load_model(tmp_path / "model.yaml")).candidates["cogging"]
    (period,) = (p for p in found.shapes if p.name == "period")
    assert period.typical <= period.upper and (period.upper <= np.pi) == hangs


def test_an_answer_names_one_law_of_one_friction(tmp_path: Path) -> None:
    rig = {"kind": "drive", "motion": "rotary", "inertia": "0.1 kg.m2"}
    dump_yaml({"rig": rig}, tmp_path / "model.yaml")
    search = Search(rig_problem([swung()], load_model(tmp_path / "model.yaml")))
    search.start()
    ranker = search.base.ranker(search.base.point.linear)
    assert ("axis_friction", "presliding") not in ranker.table(("presliding",))
    assert ("axis_damping", "presliding") in ranker.table(("presliding",))
    assert {("axis_friction",), ("presliding",)} < set(ranker.table())


@pytest.mark.parametrize("step", [1e-4, 5e-3])
def test_a_travel_until_contacts_slide_is_no_shorter_than_a_step_of_the_encoder(
    step: float,
) -> None:
    found = rig_problem([swung(step)], load_model("pendulum_rig")).candidates["presliding"]
    (travel,) = (p for p in found.shapes if p.name == "travel")
    assert travel.typical >= travel.lower >= 0.999 * step


def test_what_is_left_is_said_of_the_answer_whose_error_is_quoted(tmp_path: Path) -> None:
    """A pendulum whose rotor is lighter than the model has it: a part of the answer leaves much."""
    t, q, v, rows = np.arange(0.0, 6.0, 1e-4), 0.0, 2.0, []
    force = 1.2 * np.sin(1.4 * np.pi * t)
    for tau in force:
        rows.append(q)
        v += 1e-4 * (tau - 0.589 * np.sin(q) - 0.01 * v - 0.08 * np.tanh(v / 0.1)) / 0.02
        q += 1e-4 * v
    t, force, read = t[::10], force[::10], np.array(rows[::10])
    read += 2e-4 * np.random.default_rng(3).standard_normal(len(t))
    columns = {"axis/q [rad]": read, "axis/tau [N.m]": force}
    Trajectory(t, columns, {"kind": "drive"}).write(tmp_path / "log.csv")
    rig = {"kind": "drive", "motion": "rotary", "inertia": "0.02 kg.m2"}
    rig |= {"load": {"mass": "0.5 kg", "arm": "0.12 m"}}
    dump_yaml({"rig": rig}, tmp_path / "model.yaml")
    answer, _ = discover_logs([tmp_path / "log.csv"], (), str(tmp_path / "model.yaml"))
    assert answer.error_after < 1.2 and "Still unexplained" not in answer.sentence
