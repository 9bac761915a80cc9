"""Noise with a slow drift in it: its covariance, its density, and what it may not be taken for."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from kemba.identify.problem.noise import DriftNoise, colours, whitened
from kemba.identify.problem.problem import Rows

TIME = np.arange(2000) / 1e3


def rows(n: int) -> Rows:
    zero = np.zeros(n, dtype=int)
    return Rows(zero, zero, TIME[:n], zero, zero, ("piston/F",), np.ones(n))


def drifting_noise(seed: int, slow: float) -> np.ndarray:
    """AR(1) noise of 0.7 per row and, beside it, a lag of one second of sigma `slow`."""
    rng, found = np.random.default_rng(seed), np.zeros(len(TIME))
    for keep, sigma in ((0.7, 1.0), (np.exp(-1e-3), slow)):
        lag = np.zeros(len(TIME))
        lag[0] = rng.standard_normal()
        for i, drive in enumerate(rng.standard_normal(len(TIME) - 1)):
            lag[i + 1] = keep * lag[i] + np.sqrt(1.0 - keep**2) * drive
        found += sigma * lag
    return found


def test_out_of_a_drift_rows_are_white_with_the_density_of_their_covariance() -> None:
    columns = np.random.default_rng(0).standard_normal((6, 2))
    drift, row = DriftNoise.of(columns), np.arange(6.0)
    white = drift.out_of(row)
    root = drift.out_of(np.eye(6))
    covariance = np.eye(6) + columns @ columns.T
    assert root @ covariance @ root.T == pytest.approx(np.eye(6))
    density = multivariate_normal(np.zeros(6), covariance).logpdf(row)
    plain = multivariate_normal(np.zeros(6), np.eye(6)).logpdf(white)
    assert plain + drift.log_density == pytest.approx(density)


def test_a_drift_makes_constants_uncertain() -> None:
    """What a constant may be, by its slope alone: beside a drift not below what that may be."""
    one, n = np.ones((len(TIME), 1)), len(TIME)
    spread, claimed = [], []
    for seed in range(30):
        noise = drifting_noise(seed, slow=1.0)
        for drifts in (False, True):
            colour = colours(rows(n), noise, careful=False, drifts=drifts)
            white = whitened(rows(n), np.column_stack([one, noise]), colour)
            gram = float(white[:, 0] @ white[:, 0])
            (spread if drifts else claimed).append(float(white[:, 0] @ white[:, 1]) / gram**0.5)
    # estimates in their own standard deviations
    assert np.std(spread) == pytest.approx(1.0, abs=0.35)
    assert np.std(claimed) > 2.0


@pytest.mark.parametrize("slow", [0.0, 1.0])
def test_the_likelier_noise_is_the_one_that_is_there(slow: float) -> None:
    for seed in range(5):
        noise, n = drifting_noise(seed, slow), len(TIME)
        nats = []
        for drifts in (False, True):
            colour = colours(rows(n), noise, careful=False, drifts=drifts)
            white = whitened(rows(n), noise[:, None], colour)
            nats.append(colour[0, 0].log_density - 0.5 * float(np.sum(white**2)))
        assert (nats[1] - nats[0] > 3.0) == (slow > 0.0)
