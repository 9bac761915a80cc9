"""Derivatives by fitted quadratics are those of SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import savgol_filter

from kemba.identify.robot.motion.local_fit import derivative


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize(("shape", "half"), [((50,), 3), ((41, 2), 10), ((7, 3), 3)])
def test_derivatives_are_those_of_scipy(shape: tuple[int, ...], half: int, order: int) -> None:
    values = np.random.default_rng(1).standard_normal(shape)
    wanted = savgol_filter(values, 2 * half + 1, 2, deriv=order, delta=0.01, axis=0)
    assert derivative(values, half, order, 0.01) == pytest.approx(wanted, rel=1e-8, abs=1e-8)
