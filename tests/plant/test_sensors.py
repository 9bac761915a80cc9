"""Logs: what sensors add to the truth."""

import numpy as np
import pytest
from plant.scripts import jump

from kemba.effects.sensors import SensorBias, SensorDelay, SensorScale
from kemba.plant.repeat import Sensors, take_log
from kemba.trajectory import Trajectory


def truth() -> Trajectory:
    return jump(duration=0.1).trajectory


def test_without_noise_a_log_is_the_truth() -> None:
    true = truth()
    log = take_log(true, Sensors(), np.random.default_rng(0))
    assert set(log.names) < set(true.names)
    for name in ("body/z", "front/hip/q", "rear/piston/x", "front/valve/extend"):
        assert np.array_equal(log[name], true[name])
    assert log.meta == {"kind": "robot"}


def test_noise_has_the_size_it_says_and_spares_commands() -> None:
    true = truth()
    log = take_log(true, Sensors.usual(), np.random.default_rng(0))
    sigma = log.meta["noise"]["body/z [m]"]
    assert sigma == pytest.approx(3e-4)
    assert np.std(log["body/z"] - true["body/z"]) == pytest.approx(sigma, rel=0.3)
    assert np.array_equal(log["front/hip/tau"], true["front/hip/tau"])
    steps = log["front/hip/q"] / (2 * np.pi / 2**14)
    assert np.abs(steps - np.round(steps)).max() < 1e-6


def test_faults_of_sensors_show_in_the_log_only() -> None:
    true = truth()
    faults = [SensorBias(channel="body/pitch", b=0.01), SensorDelay(channel="body/z", dt=0.002)]
    log = take_log(true, Sensors(), np.random.default_rng(0), faults)
    assert log["body/pitch"] == pytest.approx(true["body/pitch"] + 0.01)
    assert log["body/z"][10:] == pytest.approx(true["body/z"][8:-2])


def test_an_offset_is_not_scaled_whatever_the_order_of_the_list() -> None:
    true = truth()
    faults = [SensorBias(channel="body/z", b=0.5), SensorScale(channel="body/z", k=0.1)]
    for order in (faults, faults[::-1]):
        log = take_log(true, Sensors(), np.random.default_rng(0), order)
        assert log["body/z"] == pytest.approx(1.1 * true["body/z"] + 0.5)


def test_an_accelerometer_averages_over_its_sample() -> None:
    true = truth()
    log = take_log(true, Sensors(), np.random.default_rng(0))
    speed = np.r_[0.0, np.cumsum(log["body/az"][1:] * np.diff(true.time))]
    assert speed == pytest.approx(true["body/vz"] - true["body/vz"][0], abs=1e-9)


def test_jitter_keeps_the_order_of_the_samples() -> None:
    times = Sensors(jitter=5e-4).times(0.5, np.random.default_rng(0))
    assert len(times) == 501
    assert (np.diff(times) > 0.0).all()
    assert (times >= np.arange(501) / 1000.0 - 1e-12).all()  # a row shows its tick's commands
