"""Rates from parabolas: those of SciPy, the ends included."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import savgol_filter

from kemba.identify.robot.motion.parabola import rate


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize(("shape", "rows"), [((101,), 11), ((40, 3), 5), ((11, 2), 11)])
def test_it_is_the_filter_of_scipy(shape: tuple[int, ...], rows: int, order: int) -> None:
    noisy = np.random.default_rng(1).standard_normal(shape)
    same = savgol_filter(noisy, rows, 2, deriv=order, delta=0.01, axis=0)
    assert rate(noisy, rows, 0.01, order) == pytest.approx(same, rel=1e-9, abs=1e-9)


def test_a_parabola_has_its_own_rate() -> None:
    time = np.linspace(0.0, 1.0, 51)
    fall = 0.5 + 2.0 * time - 4.905 * time**2
    assert rate(fall, 9, 0.02) == pytest.approx(2.0 - 9.81 * time, abs=1e-9)
    assert rate(fall, 9, 0.02, order=2) == pytest.approx(np.full(51, -9.81), abs=1e-7)
