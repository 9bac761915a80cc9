"""Stops and ground are read from noisy sensors: what rests there is read as resting there."""

import numpy as np
import pytest
from scipy.signal import lfilter

from kemba.identify.robot.contact import read_schedule

STROKE, DT = 0.06, 1e-3  # m, s


def wobble(keep: float, seed: int, rows: int = 2000) -> np.ndarray:
    """AR(1) noise (rows,) of unit sigma, `keep` of which is left after each row."""
    white = np.random.default_rng(seed).standard_normal(rows)
    return np.asarray(lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], white))


@pytest.mark.parametrize("sigma", [5e-5, 1e-4, 2e-4])  # m
@pytest.mark.parametrize("drift", [0.0, 1.0])  # in sigmas
def test_a_resting_piston_stays_at_its_stop(sigma: float, drift: float) -> None:
    time = DT * np.arange(2000)
    lifted = 0.02 * np.clip(np.sin(np.pi * (time - 0.5) / 0.3), 0.0, 1.0) * (time < 1.4)
    x = np.where(time > 0.5, lifted, 0.0)
    noise = sigma * (wobble(0.7, 1) + drift * wobble(np.exp(-DT), 2))
    feet = np.zeros((2000, 1, 2))
    read = (x + noise)[:, None]
    schedule = read_schedule(time, feet, read, STROKE, np.zeros((2000, 3)), np.array([sigma]))
    rests = x < 1e-6
    assert np.mean(schedule.low[rests]) > 0.98
    away = x > 3e-3
    assert not schedule.low[away].any()


def test_a_piston_that_overshoots_its_stop_still_rests_there() -> None:
    """As one does whose late reading was shifted: the extreme readings are no stop."""
    time = DT * np.arange(1200)
    x = np.clip(0.9 * (time - 0.2), 0.0, STROKE)
    hit = np.argmax(x == STROKE)
    x[hit : hit + 8] += 2e-3 * np.sin(np.pi * np.arange(8) / 8.0)
    read = (x + 2e-5 * wobble(0.0, 4, 1200))[:, None]
    feet = np.full((1200, 1, 2), 0.5)
    schedule = read_schedule(time, feet, read, STROKE, np.zeros((1200, 3)), np.array([2e-5]))
    assert schedule.high[hit + 30 :].all() and schedule.low[:190].all()


@pytest.mark.parametrize("rises", [0.0, 0.012])  # m
def test_a_foot_whose_reading_drifts_may_still_touch(rises: float) -> None:
    time = DT * np.arange(2000)
    hop = 0.3 * np.clip(np.sin(np.pi * (time - 0.5) / 0.5), 0.0, 1.0) * (time < 1.0)
    drift = rises * np.clip((time - 0.5) / 0.5, 0.0, 1.0)
    feet = np.zeros((2000, 1, 2))
    feet[:, 0, 1] = hop + drift + 1e-3 * wobble(0.7, 3)
    no = np.full((2000, 1), 0.03)
    schedule = read_schedule(time, feet, no, STROKE, np.zeros((2000, 3)), np.array([1e-4]))
    assert schedule.foot[hop == 0.0].all()
    assert not schedule.foot[hop > 0.03].any()


def test_a_foot_that_never_comes_down_touches_nothing() -> None:
    time = DT * np.arange(2000)
    feet = np.zeros((2000, 1, 2))
    feet[:, 0, 1] = 0.2 + 0.05 * np.sin(8.0 * time)
    no = np.full((2000, 1), 0.03)
    schedule = read_schedule(time, feet, no, STROKE, np.zeros((2000, 3)), np.array([1e-4]))
    assert not schedule.foot.any()
