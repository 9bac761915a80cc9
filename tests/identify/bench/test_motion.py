"""Velocity from a noisy position, and the noise itself."""

import numpy as np
import pytest
from scipy.signal import lfilter

from kemba.identify.bench.bench_log import position_noise, smooth_motion
from kemba.identify.problem.noise import ChannelNoise, caution, difference_sigma, learn, whiten


@pytest.mark.parametrize("step", [0.0, 5e-5, 2e-4, 5e-4])
def test_noise_is_learnt_from_a_moving_and_quantised_signal(step: float) -> None:
    t, rng = np.arange(4000) / 1e3, np.random.default_rng(0)
    y = 0.03 * np.sin(8 * t) + 1e-4 * rng.standard_normal(len(t))
    y = np.round(y / step) * step if step else y
    expected = np.hypot(1e-4, step / np.sqrt(12))
    assert difference_sigma(y) == pytest.approx(expected, rel=0.15 if step > 1e-4 else 0.04)


def test_impacts_are_no_noise_and_steps_are_a_floor() -> None:
    t, rng = np.arange(2000) / 1e3, np.random.default_rng(0)
    y = 1e-4 * rng.standard_normal(len(t))
    struck = y + 0.01 * np.cumsum(rng.random(len(t)) < 0.005)
    assert difference_sigma(struck) == pytest.approx(1e-4, rel=0.06)
    coarse = 1e-2 * np.round(5.0 * np.sin(2 * t))
    assert difference_sigma(coarse) == pytest.approx(1e-2 / np.sqrt(12))
    assert difference_sigma(y[:5]) == 0.0


def test_velocity_is_sharp_in_motion_and_quiet_at_rest() -> None:
    rng = np.random.default_rng(1)
    t = np.sort(np.arange(6000) / 1e3 + 5e-5 * rng.standard_normal(6000))
    moving = t > 3.0
    x = np.where(moving, 0.03 + 0.02 * np.sin(9 * (t - 3.0)), 0.03)
    v = np.where(moving, 0.18 * np.cos(9 * (t - 3.0)), 0.0)
    found = smooth_motion(t, x + 1e-4 * rng.standard_normal(len(t)))
    error = found.v - v
    rest, away = t < 2.8, t > 3.2
    assert np.std(error[rest]) < 1e-3
    assert np.std(error[away]) < 6e-3
    claimed = np.sqrt(np.mean(found.v_sigma[away] ** 2))
    assert 0.5 < np.std(error[away]) / claimed < 2.0


def test_whitening_makes_coloured_noise_white() -> None:
    rng = np.random.default_rng(2)
    r = np.zeros(20000)
    for i, e in enumerate(rng.standard_normal(len(r) - 2), start=2):
        r[i] = 0.6 * r[i - 1] + 0.2 * r[i - 2] + 2.0 * e
    colour = learn(r)
    white = whiten(r, colour)
    assert colour.sigma == pytest.approx(2.0, rel=0.03)
    assert np.std(white) == pytest.approx(1.0, rel=0.03)
    assert abs(np.corrcoef(white[1:], white[:-1])[0, 1]) < 0.03


def test_spikes_are_silenced_but_not_what_lasts() -> None:
    r = np.random.default_rng(3).standard_normal(3000)
    r[1000:1003] += 12.0
    r[2000:2500] += 12.0
    weight = caution(r)
    assert weight[1001] < 0.3
    assert weight[2100:2400].min() == 1.0
    assert np.mean(weight < 1) < 0.05


@pytest.mark.parametrize(("keep", "white"), [(0.0, True), (0.9, False), (0.95, False)])
def test_coloured_noise_of_a_position_is_learnt_at_rest(keep: float, white: bool) -> None:
    """AR(1) noise looks four times too small in differences of rows, and so does its effect on the
    velocity."""
    rng, t = np.random.default_rng(0), np.arange(8000) / 1e3
    drive = 1e-4 * np.sqrt(1.0 - keep**2) * rng.standard_normal((2, len(t)))
    still, sweep = lfilter([1.0], [1.0, -keep], drive, axis=1)
    sweep = sweep + 0.035 + 0.02 * np.sin(7.0 * t)
    noise = position_noise([(t, still), (t, sweep)])
    assert (not noise.lags) == white
    found = smooth_motion(t, still, noise=noise)
    assert found.x_sigma == pytest.approx(1e-4, rel=0.2)
    error, claimed = np.sqrt(np.mean(found.v**2)), np.sqrt(np.mean(found.v_sigma**2))
    assert error < 1.6 * claimed
    assert white or smooth_motion(t, still).x_sigma < 0.4e-4


def test_a_piston_that_never_rests_tells_no_colour() -> None:
    t = np.arange(3000) / 1e3
    x = 0.035 + 0.02 * np.sin(7.0 * t) + 1e-4 * np.random.default_rng(0).standard_normal(3000)
    assert position_noise([(t, x)]) == ChannelNoise()
