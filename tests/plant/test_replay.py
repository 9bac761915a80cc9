"""Plans executed: replay of the same model, and the controller of eq. 10."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from plant.scripts import jump, planning

from kemba.effects.mechanics.hip import Motor
from kemba.plant.certificate import executions, summaries
from kemba.plant.commands import Commands, Profile
from kemba.plant.controller import Gains, execute, hip_control, motor_limits
from kemba.plant.kernel.jit import entry
from kemba.plant.kernel.play import limited
from kemba.plant.replay import judge, replay
from kemba.plant.simulate import Simulated, run
from kemba.trajectory import Trajectory


@cache
def planned() -> Trajectory:
    """A jump as a plan of 5 ms nodes, made by the simulator itself."""
    taught = jump(duration=0.4).trajectory
    nodes = np.arange(0.0, 0.4001, 0.005)
    names = [q.name for q in planning().inputs.values()]
    inputs = taught.interpolate(nodes, hold=names)
    profiles = {name: Profile.of(nodes[:-1], inputs[name][:-1]) for name in names}
    done = run(planning(), {}, Commands(profiles), 0.4, dead_time=False).trajectory
    plan = done.interpolate(nodes)
    shifted = {f"{n} [{plan.unit(n)}]": np.r_[0.0, inputs[n][:-1]] for n in names}
    return plan.with_columns(shifted)


def test_a_plan_that_is_true_replays_exactly() -> None:
    plan = planned()
    found = replay(planning(), plan)
    assert abs(found.apex_error_m) < 2e-4  # the apex lies between nodes
    assert found.final_error_m < 1e-9
    assert (found.landed, found.fault) == (True, None)  # it ends in the air, as planned
    assert found.end is not None and found.end.velocity_m_s < 1e-9
    assert found.compared.events and not found.compared.difference
    assert set(found.summary()) == {
        "apex_error_m", "touchdown_error_s", "final_error_m", "landed", "fault", "order_kept",
        "events", "end",
    }  # fmt: skip


def test_a_plan_that_is_not_true_is_found_out() -> None:
    plan = planned()
    lie = plan.with_columns({"body/z [m]": plan["body/z"] + 0.1 * plan.time})
    assert replay(planning(), lie).apex_error_m < -0.01


def test_the_certificate_holds_all_executions() -> None:
    done = executions(planning(), planned(), standing_table(), planning())
    found = summaries(planning(), done)
    assert found["replay"]["final_error_m"] < 1e-9
    assert found["plant_replay"]["apex_error_m"] < -0.1
    assert found["table_replay"] == found["plant_replay"]  # here the plant is the same model
    assert executions(planning(), planned(), standing_table(), None)["plant_replay"] is None
    buried = planned().with_columns({"body/z [m]": planned()["body/z"] - 0.1})
    assert executions(planning(), buried, standing_table(), None)["replay"] is None


def standing_table(lead: float = 0.006) -> Trajectory:
    time = np.arange(0, 0.1, 1e-3)
    pose = planning().mechanism.standing
    columns = {}
    for leg in ("front", "rear"):
        columns[f"{leg}/hip/q [rad]"] = np.full(100, pose[f"{leg}/hip/q"])
        columns[f"{leg}/hip/w [rad.s-1]"] = np.zeros(100)
        columns[f"{leg}/hip/tau [N.m]"] = np.zeros(100)
        for chamber in ("extend", "retract"):
            columns[f"{leg}/valve/{chamber} [1]"] = np.zeros(100)
    return Trajectory(time, columns, {"lead": lead})


def test_the_controller_holds_a_standing_robot() -> None:
    done = execute(standing_table(), planning())
    assert done.trajectory.time[0] == -0.006  # the plan begins at 0
    assert np.abs(done.trajectory["front/hip/tau"]).max() < 1e-6


@pytest.mark.parametrize("dead_time", [True, False])
def test_a_valve_opened_in_the_first_row_was_closed_before(dead_time: bool) -> None:
    """It acts its dead time of 6 ms after the row, not from the beginning."""
    table = standing_table()
    table = table.with_columns({"front/valve/extend [1]": np.ones(len(table))})
    done = execute(table, planning(), dead_time=dead_time).trajectory
    acts = done.time[done["front/chamber/extend/F"] > 1.0][0] - 1e-3
    assert acts == pytest.approx(0.0 if dead_time else -0.006, abs=1e-9)


def marked_table(rows: int = 20) -> Trajectory:
    """A standing table in which row k feeds forward k N.m at the front hip, -k at the rear."""
    marks = np.arange(100.0)
    torques = {"front/hip/tau [N.m]": marks, "rear/hip/tau [N.m]": -marks}
    table = standing_table().with_columns(torques)
    columns = {h: table[n][:rows] for h, n in zip(table.headers, table.names, strict=True)}
    return Trajectory(table.time[:rows], columns, table.meta)


@pytest.mark.parametrize(
    ("time", "row"), [(0.0, 0), (0.0009, 0), (0.001, 1), (0.0074, 7), (0.019, 19), (1.0, 19)]
)
def test_the_controller_plays_the_row_whose_time_has_come(time: float, row: int) -> None:
    """Each row holds for its millisecond, the last one for good."""
    model, table = planning(), marked_table()
    (wanted,) = hip_control(model, table, Gains()).at(np.array([time]))
    assert wanted[:, 2] == pytest.approx([row, -row])
    assert wanted[0, 0] == table["front/hip/q"][0]


def test_a_played_table_shows_in_the_motion_when_its_row_is_due() -> None:
    done = execute(marked_table(), planning(), Gains(K_p=0.0, K_d=0.0)).trajectory
    assert done["front/hip/tau"][:10] == pytest.approx(np.arange(10.0))


@cache
def landing() -> tuple[Trajectory, Simulated]:
    """A plan that ends standing, and its execution to the letter."""
    stands = execute(standing_table(), planning()).run
    return stands.trajectory, stands


def fault_of(**changes: float) -> str | None:
    """What is wrong with a landing whose last row differs by `changes` (columns, / as __)."""
    plan, stands = landing()
    columns = {}
    for name, change in changes.items():
        column = name.replace("__", "/")
        values = plan[column].copy()
        values[-1] = change + (values[-1] if column == "body/pitch" else 0.0)
        columns[f"{column} [{plan.unit(column)}]"] = values
    executed = replace(stands, trajectory=plan.with_columns(columns))
    return judge(planning(), plan, plan.time, executed).fault


def test_a_landing_is_judged_by_how_it_ends() -> None:
    assert fault_of() is None
    assert fault_of(body__pitch=0.3) is None
    far = "ends upright, but another number of turns away"
    assert fault_of(body__pitch=2 * np.pi + 0.3) == far  # a full turn is no fall
    for pitch in (0.5, -0.5, np.pi, 2 * np.pi - 0.5):  # forward and backward
        assert fault_of(body__pitch=pitch) == "tips over"
    for point in ("front/hip", "rear/hip", "front/knee", "rear/knee"):
        name = f"{point.replace('/', '__')}__z"
        assert fault_of(**{name: -1e-3}) == f"meets the ground with the {point.replace('/', ' ')}"
    for leg in ("front", "rear"):
        assert fault_of(**{f"{leg}__foot__z": 0.02}) == f"ends with the {leg} foot in the air"


def test_a_backflip_ends_upright_after_a_full_turn() -> None:
    plan, stands = landing()
    turn = plan["body/pitch"] + 2 * np.pi * np.clip(plan.time / 0.05, 0.0, 1.0)
    flip = plan.with_columns({"body/pitch [rad]": turn})
    assert judge(planning(), flip, plan.time, replace(stands, trajectory=flip)).fault is None
    assert judge(planning(), flip, plan.time, stands).fault is not None


def test_the_controller_brings_a_hip_back() -> None:
    start = {"body/z": 1.0, "front/hip/q": planning().mechanism.standing["front/hip/q"] + 0.2}
    done = execute(standing_table(), planning(), Gains(K_p=150.0, K_d=4.0), start=start).trajectory
    torque, error = done["front/hip/tau"], done["front/hip/q"] - start["front/hip/q"]
    assert torque[0] == pytest.approx(-24.8)  # 150 * 0.2 saturates
    assert error[-1] == pytest.approx(-0.2, abs=0.1)


@entry
def limited_torque(tau: float, w: float, limits: np.ndarray) -> float:
    return limited(tau, w, limits)


def test_the_motor_gives_less_the_faster_it_turns() -> None:
    def torque(motor: Motor | None, tau: float, w: float) -> float:
        return limited_torque(tau, w, np.array(motor_limits(motor)))

    motor = Motor()
    assert torque(motor, 30.0, 0.0) == 24.8
    assert torque(motor, 30.0, 41.9) == pytest.approx(8.3)
    assert torque(motor, -30.0, 41.9) == -24.8
    assert torque(motor, 30.0, 60.0) == 0.0
    assert torque(None, 30.0, 60.0) == 30.0


def test_a_robot_in_the_air_is_held_until_plan_time_zero() -> None:
    """The lead is there for valves; a body that is dropped does not fall during it."""
    high = {"body/z": 1.0}
    done = execute(standing_table(0.006), planning(), start=high).trajectory
    assert done.time[0] == 0.0
    assert done["body/z"][0] == pytest.approx(1.0)
    fallen = 1.0 - np.interp(0.02, done.time, done["body/z"])
    assert fallen == pytest.approx(0.5 * 9.81 * 0.02**2, rel=0.2)
    assert execute(standing_table(0.006), planning()).trajectory.time[0] == -0.006
