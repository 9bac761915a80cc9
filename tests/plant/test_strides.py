"""A planned bound (`kemba-opt solve bound.yaml`): executions begin in motion, strides repeat."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from kemba.errors import KembaError
from kemba.model import Model, load_model
from kemba.model.rest import moving_start, state_at
from kemba.ocp.controller import controller_table
from kemba.ocp.reading import joined
from kemba.plant.certificate import executions
from kemba.plant.commands import Commands, Profile
from kemba.plant.controller import condition_of
from kemba.plant.repeat import repeat_run
from kemba.plant.replay import Replay, first_row, replay
from kemba.plant.simulate import run
from kemba.plant.strides import kept, multipliers
from kemba.policy.course import course_of
from kemba.trajectory import Trajectory

PLAN = Path(__file__).with_name("plans") / "bound.csv"


@cache
def bound() -> tuple[Model, Trajectory]:
    return load_model("planning"), Trajectory.read(PLAN)


def test_a_stride_replays_from_its_moving_start() -> None:
    model, plan = bound()
    assert moving_start(model, plan)
    done = replay(model, plan)
    assert abs(done.apex_error_m) < 1e-3 and done.final_error_m < 1e-3
    real = done.trajectory
    for q in (*model.mechanism.coordinates, *model.mechanism.velocities, *model.states.values()):
        if q.name != "body/x":
            assert real[q.name][-1] == pytest.approx(real[q.name][0], abs=0.02 * q.scale), q.name


def test_table_and_plant_begin_in_the_same_state() -> None:
    """The plant has other states; its chambers must press as the plan's do."""
    model, plan = bound()
    plant = load_model("plant")
    q = [plan[c.name][0] for c in plant.mechanism.coordinates]
    start = state_at(plant, np.array(q), moving_start(model, plan))
    area = plant.mechanism.need_cylinder().area_extend
    pressed = [(start[f"{leg}/chamber/extend/P"] - 101325.0) * area for leg in ("front", "rear")]
    assert pressed == pytest.approx(
        [plan[f"{leg}/chamber/extend/F"][0] for leg in ("front", "rear")]
    )
    table = controller_table(model, plan)
    done = executions(model, plan, table, plant)
    for name, most in (("table_replay", 0.01), ("plant_replay", 0.05)):
        found = done[name]
        assert found is not None and found.final_error_m < most
        assert found.trajectory.time[0] == 0.0 and found.trajectory["body/vx"][0] > 0.5


def test_logs_and_policies_begin_in_motion(tmp_path: Path) -> None:
    """All that executes a table finds the start in its metadata, also after writing and reading."""
    model, plan = bound()
    plan.write(tmp_path / "trajectory.csv")
    controller_table(model, plan).write(tmp_path / "controller.csv")
    (taken,) = repeat_run(tmp_path, load_model("plant"), tmp_path / "logs")
    assert taken.replay is not None and taken.replay.final_error_m < 0.05
    course = course_of(model, Trajectory.read(tmp_path / "controller.csv"))
    assert course.motion["body/vx"][0] == pytest.approx(plan["body/vx"][0])
    assert course.motion["body/z"][-1] == pytest.approx(plan["body/z"][-1], abs=0.01)


@pytest.mark.parametrize("start", ["fast", {"body/vx": "fast"}])
def test_a_start_that_is_no_state_is_told(start: object) -> None:
    model, plan = bound()
    table = controller_table(model, plan)
    table.meta["start"] = start
    with pytest.raises(KembaError, match="`start` is"):
        condition_of(table, model)


def test_strides_are_kept_until_the_robot_falls() -> None:
    model, plan = bound()
    row = joined([plan] * 3)
    done = replay(model, row)
    assert kept(plan, done, 3) == 3
    fallen = done.trajectory["body/z"].copy()
    second = done.trajectory.time > 1.5 * plan.time[-1]
    fallen[second] = 0.1
    lower = done.trajectory.with_columns({"body/z [m]": fallen})
    changed = Replay(**{**vars(done), "trajectory": lower})
    assert kept(plan, changed, 3) == 1
    assert kept(plan, None, 3) == 0


def test_multipliers_say_how_an_error_grows() -> None:
    """The growth of a small error over one stride, simulated, is that of the largest multiplier."""
    model, plan = bound()
    found = np.sort(np.abs(multipliers(model, plan)))[::-1]
    assert found[0] > 1.0, "a bound without feedback is unstable"
    clock = plan.time - plan.time[0]
    inputs = {q.name: Profile.of(clock[:-1], plan[q.name][1:]) for q in model.inputs.values()}

    def pitch(off: float) -> float:
        start = first_row(model, plan)
        start["body/pitch"] += off
        done = run(model, start, Commands(inputs), float(clock[-1]), dead_time=False).trajectory
        return float(done["body/pitch"][-1])

    grown = abs(pitch(1e-5) - pitch(-1e-5)) / 2e-5
    assert grown < 3 * found[0]
