"""Whitening: what was made with a colour comes out white, from the first row on."""

import numpy as np
import pytest

from kemba.identify.problem.noise import Colour, difference_sigma, learn, whiten


def series(phi: float, sigma: float, count: int, rng: np.random.Generator) -> np.ndarray:
    """Stationary AR(1) series (200, count): each row correlated with the one before by `phi`."""
    r = np.empty((200, count))
    r[0] = rng.normal(0.0, sigma / np.sqrt(1 - phi**2), count)
    for t in range(1, 200):
        r[t] = phi * r[t - 1] + rng.normal(0.0, sigma, count)
    return r


@pytest.mark.parametrize("phi", [0.9, -0.6])
def test_every_row_is_white_with_unit_variance(phi: float) -> None:
    """Over 4000 series, row by row: also the first, which has no row before it."""
    rng = np.random.default_rng(0)
    white = whiten(series(phi, 0.3, 4000, rng), Colour(np.array([phi]), 0.3))
    assert np.abs(white.std(axis=1) - 1.0).max() < 0.05
    echo = np.mean(white[1:] * white[:-1], axis=1)
    assert np.abs(echo).max() < 0.08


def test_the_spread_is_that_of_the_series() -> None:
    assert Colour(np.array([0.9]), 0.3).spread == pytest.approx(0.3 / np.sqrt(1 - 0.81), rel=1e-6)


def test_the_colour_is_learnt_back() -> None:
    r = series(0.8, 0.9, 20, np.random.default_rng(1)).T.ravel()
    found = learn(r)
    assert found.phi[0] == pytest.approx(0.8, abs=0.05)
    assert found.sigma == pytest.approx(0.9, rel=0.05)


def test_what_is_left_is_never_believed_to_be_much_less_than_the_noise() -> None:
    assert learn(0.01 * np.random.default_rng(2).standard_normal(500)).sigma == 0.6


@pytest.mark.parametrize("step", [0.0, 0.5])
def test_white_noise_on_smooth_motion_is_measured(step: float) -> None:
    """Also where readings are rounded to half of its sigma."""
    t = np.arange(4000) / 1e3
    y = 5.0 * np.sin(6 * t) + np.random.default_rng(3).standard_normal(4000)
    y = np.round(y / step) * step if step else y
    assert difference_sigma(y) == pytest.approx(1.0, rel=0.08)
