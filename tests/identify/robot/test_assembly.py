"""How a machine is put together: its boom's lever and where its mass is, named from logs."""

from pathlib import Path

import pytest

pytest.importorskip("numba")

from mujoco_twin.cases import robot_case
from mujoco_twin.hidden import machine
from mujoco_twin.machine import run
from mujoco_twin.sensors import Sensors
from robot_logs import hop

from kemba.effects.mechanics.boom import BoomLever
from kemba.identify.adopt import item
from kemba.identify.discover import discover
from kemba.identify.logs.reading import read_logs
from kemba.identify.problem.sensor_faults import SensorFaults, is_fault
from kemba.identify.robot.problem import robot_problem
from kemba.mechanism import load_robot
from kemba.model import load_model
from kemba.model.spec import ModelSpec
from kemba.trajectory import Trajectory

SEEDS = {"boom_lever": 11, "mass_split": 12}


@pytest.mark.nightly
@pytest.mark.parametrize("kind", sorted(SEEDS))
def test_it_is_named_and_nothing_else(kind: str, tmp_path: Path) -> None:
    paths, truth = robot_case(tmp_path, [kind], seed=SEEDS[kind], runs=3, sensors=Sensors())
    answer = discover(robot_problem(read_logs(paths), load_model("planning"))).answer
    assert answer.added == (kind,), answer.sentence
    ((name, true),) = truth["effects"][0]["parameters"].items()
    found = answer.ranking[0].parameters[name]
    assert found.low < true < found.high
    assert found.value == pytest.approx(true, rel=0.1)


def test_standing_feet_do_not_tell_a_lever_from_a_length() -> None:
    made = machine(load_robot("kemba"), [{"kind": "boom_lever", "parameters": {"k": 0.03}}])
    logs = []
    for i in range(2):
        columns = Sensors().columns(run(made, hop(3 + i)), made.read, (), [3, i])
        time = columns.pop("time [s]")
        logs.append(Trajectory(time, columns, {"kind": "robot", "name": f"hop{i}"}))
    problem = robot_problem(logs, load_model("planning"))
    assert problem.lengths  # a length would do as well, and the remark says so
    assert problem.standing.lever == pytest.approx(0.03, abs=0.012)
    (remark,) = problem.validate()
    assert "or if the boom is +" in remark


def test_a_lever_is_a_scale_of_both_places() -> None:
    for effects, theta in (([], {"boom_lever.k": 0.02}), ([BoomLever(k=0.02)], {})):
        sensors = SensorFaults(effects)
        assert [f.k for f in sensors.at(theta, "body/z")] == [pytest.approx(-0.0196, abs=1e-4)]
        assert [f.k for f in sensors.at(theta, "body/x")] == [pytest.approx(-0.0196, abs=1e-4)]
        assert sensors.at(theta, "body/pitch") == []
        assert sensors.present == bool(effects)
    assert is_fault("boom_lever.k") and not is_fault("boom_force.F")


@pytest.mark.parametrize(("kind", "name"), [("boom_lever", "k"), ("mass_split", "m")])
def test_they_are_written_as_a_model_reads_them(kind: str, name: str) -> None:
    row = item(kind, {name: {"value": 0.02}})
    spec = ModelSpec.model_validate({"base": "planning", "effects": [row]})
    assert getattr(spec.effects[0], name) == 0.02
