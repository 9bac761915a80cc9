"""Feet that slide: how rough the ground is shows in the force that they need, and only there."""

import numpy as np
import pytest

pytest.importorskip("numba")

from twin import catalogue, measure, repertoire, run

from kemba.identify.robot.contact import ContactSchedule, read_schedule
from kemba.identify.robot.problem import RobotProblem, robot_problem
from kemba.model.spec import load_model
from kemba.trajectory import Trajectory


def slid(mu: float, noise: measure.Sensors | None = None) -> RobotProblem:
    """A log of feet that slide on ground of friction coefficient `mu`, under the usual model."""
    rough = [catalogue.hidden("ground_friction", mu=mu)]
    truth = run.simulate(repertoire.motion("slide", 1), rough)
    columns = measure.robot_log(
        truth, noise or measure.Sensors(), (), np.random.default_rng(round(1e3 * mu))
    )
    time = columns.pop("time [s]")
    return robot_problem(
        [Trajectory(time, columns, {"kind": "robot", "name": "slide"})], load_model("planning")
    )


def coefficient(problem: RobotProblem) -> tuple[float, float]:
    """The friction coefficient that fits best, and its standard error."""
    slope = problem.jacobian({}, ["ground_friction.mu"])[:, 0]
    information = float(slope @ slope)
    return 1.0 - float(slope @ problem.residual({})) / information, information**-0.5


@pytest.mark.parametrize("mu", [0.6, 0.8, 1.0, 1.3])
def test_the_friction_coefficient_is_read_from_sliding_feet(mu: float) -> None:
    value, error = coefficient(slid(mu))
    assert error < 0.08
    assert abs(value - mu) < 3.0 * error


def test_sensors_that_drift_hide_some_sliding_but_not_all() -> None:
    value, error = coefficient(slid(0.7, measure.Sensors(noise=2.0, keep=0.7, drift=1.0)))
    assert error < 0.2
    assert abs(value - 0.7) < 3.0 * error


def schedule_of_feet(z: np.ndarray, x: np.ndarray) -> ContactSchedule:
    """The schedule of two feet at heights `z` (n, 2) and places `x` (n, 2) [m]."""
    n = len(z)
    feet, still = np.stack([x, z], axis=-1), np.full((n, 2), 0.03)
    noise = np.full(2, 1e-5)
    return read_schedule(np.arange(n) / 1e3, feet, still, 0.07, np.zeros((n, 3)), noise)


def test_a_foot_is_not_judged_while_the_other_one_strikes() -> None:
    n = 300
    x = np.stack([0.5 * np.arange(n) / 1e3, np.zeros(n)], axis=1)
    z = np.zeros((n, 2))
    assert (schedule_of_feet(z, x).slides[10:-10, 0] == 1.0).all()
    z[:150, 1] = 0.05 * (1.0 - np.arange(150) / 150.0)
    struck = schedule_of_feet(z, x)
    near = int(np.argmax(struck.foot[:, 1]))
    assert (struck.slides[10 : near - 1, 0] == 1.0).all()
    assert not struck.slides[near : near + 20].any()
    assert (struck.slides[near + 30 : -10, 0] == 1.0).all()
