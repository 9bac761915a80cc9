"""The noise of a block is what a fit to the other blocks leaves, not what is left after its own."""

import numpy as np
import pytest

from kemba.identify.infer.significance import MOST, left_out_noise
from kemba.identify.problem.problem import Array, Labels

BLOCKS, ROWS, EFFECTS = 24, 50, 12
LABELS = np.repeat(np.arange(BLOCKS), ROWS)


def fitted(jacobian: Array, measured: Array, width: Array, rows: Labels | slice) -> Array:
    """Error (n,) everywhere of a fit to some rows, every effect free within its width."""
    own, precision = jacobian[rows], np.diag(1.0 / width**2)
    z = np.linalg.solve(own.T @ own + precision, own.T @ measured[rows])
    return np.asarray(measured - jacobian @ z)


def slow(rng: np.random.Generator, columns: int, memory: float = ROWS / 3.0) -> Array:
    """Columns (n, c) of noise of variance one that lasts `memory` rows, a third of a block."""
    keep, out = np.exp(-1.0 / memory), rng.standard_normal((BLOCKS * ROWS, columns))
    for k in range(1, len(out)):
        out[k] = keep * out[k - 1] + np.sqrt(1.0 - keep**2) * out[k]
    return np.asarray(out)


def test_it_is_the_error_of_a_fit_to_the_other_blocks() -> None:
    rng = np.random.default_rng(1)
    jacobian = rng.standard_normal((BLOCKS * ROWS, EFFECTS)) * np.logspace(-3, 3, EFFECTS)
    width, measured = np.logspace(2, -4, EFFECTS), rng.standard_normal(BLOCKS * ROWS)
    left = fitted(jacobian, measured, width, slice(None))
    shuffled = rng.permutation(len(LABELS))  # rows of a block need not stand together
    found = left_out_noise(jacobian[shuffled], left[shuffled], width, LABELS[shuffled])
    for block in (0, 7, BLOCKS - 1):
        own = block == LABELS
        there = fitted(jacobian, measured, width, ~own)
        assert found[block] == pytest.approx(jacobian[own].T @ there[own], rel=1e-6)


def test_slow_noise_that_a_fit_took_for_effects_is_given_back() -> None:
    """The noise of many logs along an effect, beside what redrawn signs make of one log."""
    true, plain, given = [], [], []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        jacobian, noise = slow(rng, EFFECTS), slow(rng, 1)[:, 0]
        width = np.full(EFFECTS, 100.0)
        left = fitted(jacobian, noise, width, slice(None))
        pieces = np.array([jacobian[b == LABELS].T @ left[b == LABELS] for b in range(BLOCKS)])
        true.append(np.mean((jacobian.T @ noise) ** 2))
        plain.append(np.mean(np.sum(pieces**2, axis=0)))
        given.append(np.mean(np.sum(left_out_noise(jacobian, left, width, LABELS) ** 2, axis=0)))
    assert np.mean(plain) < 0.65 * np.mean(true)
    assert 0.8 * np.mean(true) < np.mean(given) < 1.3 * np.mean(true)


def test_what_acts_in_one_block_only_is_not_all_noise() -> None:
    rng = np.random.default_rng(2)
    jacobian = np.where(LABELS == 3, 1.0, 0.0)[:, None]
    measured, width = 50.0 * jacobian[:, 0] + rng.standard_normal(BLOCKS * ROWS), np.full(1, 1e3)
    left = fitted(jacobian, measured, width, slice(None))
    own = jacobian[:, 0] @ left
    found = left_out_noise(jacobian, left, width, LABELS)
    assert found[3, 0] == pytest.approx(MOST * own)
    assert abs(found[3, 0]) < 0.01 * (jacobian[:, 0] @ measured)


def test_half_the_power_keeps_white_noise() -> None:
    """With half the power of the enlargement the noise of six unlike blocks has its true size."""
    true, half, full = [], [], []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        loud = rng.uniform(0.2, 3.0, (BLOCKS, EFFECTS))[LABELS]  # motions that tell other effects
        jacobian = loud * rng.standard_normal((BLOCKS * ROWS, EFFECTS))
        noise, width = rng.standard_normal(BLOCKS * ROWS), np.full(EFFECTS, 100.0)
        few = LABELS < 6
        left = fitted(jacobian[few], noise[few], width, slice(None))
        true.append(np.mean((jacobian[few].T @ noise[few]) ** 2))
        for power, found in ((0.5, half), (1.0, full)):
            pieces = left_out_noise(jacobian[few], left, width, LABELS[few], power)
            found.append(np.mean(np.sum(pieces**2, axis=0)))
    assert np.mean(half) == pytest.approx(np.mean(true), rel=0.15)
    assert np.mean(full) > 1.2 * np.mean(true)
