"""Coloured noise of a robot's sensors: learnt, stated, and no reason to suspect the model."""

import numpy as np
import pytest

pytest.importorskip("numba")

from robot_logs import hops
from twin import catalogue, measure

from kemba.identify.compare.compare import compare
from kemba.identify.discover import discover
from kemba.identify.infer.null_model import STRONG, log_likelihood, with_learnt_colour
from kemba.identify.problem.noise import ChannelNoise
from kemba.identify.robot.filter import coloured, simulated
from kemba.identify.robot.problem import RobotProblem, robot_problem
from kemba.model.spec import load_model
from kemba.trajectory import Trajectory

KEEP = 0.9  # AR(1) per ms: a correlation time of 9.5 ms
MEMORY = -1e-3 / np.log(KEEP)
SENSORS = measure.Sensors(keep=KEEP)


def noisy(*effects: dict, sensors: measure.Sensors = SENSORS) -> list[Trajectory]:
    """Hops whose sidecars state the whole noise of each sensor, and not its colour."""
    logs, _ = hops(*effects, sensors=sensors)
    for log in logs:
        known = [name for name in log.names if measure.base(name) in measure.CHANNELS]
        log.meta["noise"] = {name: sensors.spread(name) for name in known}
    return logs


@pytest.fixture(scope="module")
def clean() -> RobotProblem:
    return robot_problem(noisy(), load_model("planning"))


@pytest.fixture(scope="module")
def learnt(clean: RobotProblem) -> RobotProblem:
    found = with_learnt_colour(clean, {})
    assert isinstance(found, RobotProblem)
    return found


def test_the_memory_of_every_sensor_is_learnt(learnt: RobotProblem) -> None:
    for noise in learnt.state.noise:
        ((size, memory),) = noise.lags
        assert 0.7 < size < 1.4 and noise.white < 0.3
        assert MEMORY / 2.5 < memory < MEMORY * 2.5


def test_errors_are_white_where_the_colour_is_known(
    clean: RobotProblem, learnt: RobotProblem
) -> None:
    def echo(problem: RobotProblem) -> float:
        rows, r = problem.rows(), problem.residual({})
        pairs = [r[(rows.channel == k) & (rows.phase == "flight")] for k in range(7)]
        return float(np.mean([abs(np.corrcoef(e[1:], e[:-1])[0, 1]) for e in pairs]))

    assert echo(clean) > 2.0 * echo(learnt)
    assert echo(learnt) < 0.2


def test_a_clean_machine_is_explained(learnt: RobotProblem) -> None:
    found = compare(learnt, "planning")
    assert found.tolerable or found.good, found.sentence
    assert 0.7 < found.tolerant_ratio < 1.15


def test_nothing_is_found_in_a_clean_machine(clean: RobotProblem) -> None:
    answer = discover(clean).answer
    assert answer.verdict == "nothing", answer.sentence
    assert 0.7 < answer.error_after < 1.2


@pytest.mark.nightly
@pytest.mark.parametrize("sensors", [SENSORS, measure.Sensors(keep=0.7, drift=1.0, steps=3.0)])
@pytest.mark.parametrize("name", ["seal_friction", "hip_friction", "boom_force"])
def test_a_hidden_effect_is_named(name: str, sensors: measure.Sensors) -> None:
    logs = noisy(catalogue.hidden(name), sensors=sensors)
    answer = discover(robot_problem(logs, load_model("planning"))).answer
    assert answer.verdict == "missing" and answer.added == (name,), answer.sentence


@pytest.mark.parametrize("drift", [0.0, 2.0])
def test_logs_tell_whether_their_sensors_drift(drift: float) -> None:
    sensors = measure.Sensors(keep=0.7, drift=drift)
    found = with_learnt_colour(robot_problem(noisy(sensors=sensors), load_model("planning")), {})
    drifting = found.drifting()
    assert drifting is not None and drifting.drifting() is None
    gain = log_likelihood(drifting, {}) - log_likelihood(found, {})
    assert (gain > STRONG) == (drift > 0.0)


@pytest.mark.parametrize(
    ("name", "asked"),
    [
        ("sensor_bias:body/z.b", True),
        ("geometry:tibia/length.d", True),
        ("boom_lever.k", True),
        ("seal_friction.F_c", False),
    ],
)
def test_drifts_are_looked_for_where_they_imitate_the_answer(name: str, asked: bool) -> None:
    logs = noisy(sensors=measure.Sensors(keep=0.7, drift=2.0))
    found = with_learnt_colour(robot_problem(logs, load_model()), {name: 1e-3}, careful=True)
    assert (found.drifting() is None) == asked


def test_white_noise_stays_as_it_is_stated() -> None:
    logs = noisy(sensors=measure.Sensors())
    found = with_learnt_colour(robot_problem(logs, load_model("planning")), {})
    assert isinstance(found, RobotProblem)
    assert all(noise == ChannelNoise() for noise in found.state.noise)


def test_a_stated_correlation_time_is_kept(clean: RobotProblem) -> None:
    logs = noisy()
    for log in logs:
        log.meta["noise_time"] = {"body/z": MEMORY}
    problem = robot_problem(logs, load_model("planning"))
    z = problem.physics.channels.index("body/z")
    ((size, memory),) = problem.state.noise[z].lags
    assert memory == MEMORY and size == pytest.approx(1.0, abs=0.01)
    again = with_learnt_colour(problem, {})
    assert isinstance(again, RobotProblem)
    assert again.state.noise[z] == problem.state.noise[z]


def test_simulated_noise_has_the_spread_and_the_memory_asked_for(clean: RobotProblem) -> None:
    state = clean.state
    noise = [ChannelNoise(0.5, ((2.0, 0.008),)), *[ChannelNoise()] * 6]
    system = coloured(state.motion.plain, noise, state.batch.sigma, state.batch.h)
    y = simulated(system, 40, np.random.default_rng(0))[:, 0, 0] / state.batch.sigma[0, 0]
    assert np.std(y) == pytest.approx(np.sqrt(0.25 + 4.0), rel=0.1)
    echo = np.mean(y[8:] * y[:-8])
    assert echo == pytest.approx(4.0 * np.exp(-1.0), rel=0.25)
