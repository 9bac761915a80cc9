"""Colour and drift of one sensor, told from autocovariances."""

import numpy as np
import pytest

from kemba.identify.problem.noise import (
    ChannelNoise,
    ColourSettings,
    chosen_noise,
)

COLOUR, DRIFT = 8e-3, 1.0  # s


def learnt(noise: ChannelNoise, most: float, rows: float = 2000.0) -> ChannelNoise:
    """What is learnt of a sensor with this noise, read every millisecond."""
    settings = ColourSettings
    apart = 1e-3 * np.array(settings.lags)
    memories = (0.0, *settings.memories, *settings.drifts)
    kinds = {m: ChannelNoise(0.0, ((1.0, m),)) if m else ChannelNoise() for m in memories}
    made = {(0, m): kind.covariance(apart)[None, :] for m, kind in kinds.items()}
    measured = noise.covariance(apart)[None, :]
    counts = np.full(measured.shape, rows)
    return chosen_noise(made, measured, counts, np.array([most]), np.array([True]))[0]


def test_a_large_drift_does_not_hide_the_colour_beside_it() -> None:
    """The drift hardly moves from row to row; without the colour every row would be too sure."""
    found = learnt(ChannelNoise(0.0, ((0.7, COLOUR), (1.5, DRIFT))), most=10.0)
    (colour, fast), (drift, slow) = found.lags
    assert colour == pytest.approx(0.7, rel=0.02) and fast == pytest.approx(COLOUR, rel=0.05)
    assert drift == pytest.approx(1.5, rel=0.02) and slow == pytest.approx(DRIFT, rel=0.05)


def test_a_drift_gives_way_where_the_noise_is_more_than_is_believed() -> None:
    found = learnt(ChannelNoise(0.0, ((0.7, COLOUR), (1.5, DRIFT))), most=1.2)
    (colour, _), (drift, _) = found.lags
    assert colour == pytest.approx(0.7, rel=0.03)
    assert np.hypot(colour, drift) == pytest.approx(1.2, rel=0.03)


def test_colour_that_is_slight_beside_faster_noise_is_left_out() -> None:
    assert learnt(ChannelNoise(1.0, ((0.4, COLOUR),)), most=10.0) == ChannelNoise()


def test_a_drift_that_is_slight_beside_colour_is_left_out() -> None:
    found = learnt(ChannelNoise(0.0, ((1.0, COLOUR), (0.3, DRIFT))), most=10.0)
    ((_, memory),) = found.lags
    assert memory < 2.0 * COLOUR
