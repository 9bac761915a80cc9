"""Plans executed: replay of the same model, and the controller of eq. 10."""

from functools import cache

import numpy as np
import pytest
from plant.scripts import jump, planning

from kemba.effects.mechanics.motor import Motor
from kemba.plant import Gains, Profile, execute, replay, replays, run
from kemba.plant.execution.controller import motor_limits
from kemba.plant.kernel.control import limited
from kemba.plant.kernel.jit import entry
from kemba.plant.simulation.commands import Commands
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
    assert (found.landed, found.fault) == (False, "the plan ends in the air")
    assert set(found.summary()) == {
        "apex_error_m", "touchdown_error_s", "final_error_m", "landed", "fault",
    }  # fmt: skip


def test_a_plan_that_is_not_true_is_found_out() -> None:
    plan = planned()
    lie = plan.with_columns({"body/z [m]": plan["body/z"] + 0.1 * plan.time})
    assert replay(planning(), lie).apex_error_m < -0.01


def test_the_certificate_holds_both_replays() -> None:
    found = replays(planning(), planned(), standing_table(), planning())
    assert found["replay"]["final_error_m"] < 1e-9
    assert found["plant_replay"]["apex_error_m"] < -0.1
    assert replays(planning(), planned(), standing_table(), None)["plant_replay"] is None
    buried = planned().with_columns({"body/z [m]": planned()["body/z"] - 0.1})
    assert replays(planning(), buried, standing_table(), None)["replay"] is None


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
    assert done.lead == 0.006
    assert np.abs(done.trajectory["front/hip/tau"]).max() < 1e-6


def test_the_controller_brings_a_hip_back() -> None:
    start = {"body/z": 1.0, "front/hip/q": planning().mechanism.standing["front/hip/q"] + 0.2}
    done = execute(standing_table(), planning(), Gains(150.0, 4.0), start=start).trajectory
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
