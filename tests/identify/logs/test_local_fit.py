"""Polynomials fitted around each row are those of SciPy."""

import numpy as np
import pytest
from scipy.signal import savgol_filter

from kemba.identify.logs.local_fit import local_fit


@pytest.mark.parametrize("derivative", [0, 1, 2])
@pytest.mark.parametrize("degree", [2, 3])
@pytest.mark.parametrize(("shape", "width"), [((50,), 3), ((41, 2), 10), ((7, 3), 3)])
def test_local_fits_are_those_of_scipy(
    shape: tuple[int, ...], width: int, degree: int, derivative: int
) -> None:
    values = np.random.default_rng(1).standard_normal(shape)
    own = {"deriv": derivative, "delta": 0.01, "axis": 0}
    wanted = savgol_filter(values, 2 * width + 1, degree, **own)
    found = local_fit(values, width, 0.01, degree, derivative)
    assert found == pytest.approx(wanted, rel=1e-7, abs=1e-7)
