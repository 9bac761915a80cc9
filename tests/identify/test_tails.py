"""Tails are those of SciPy's distributions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from kemba.identify.compare.bins import chi2_above, false_discoveries, normal_above, normal_at


def test_tails_are_those_of_scipy() -> None:
    assert chi2_above(31.2, 17) == stats.chi2.sf(31.2, 17)
    z = np.array([-1.0, 0.3, 8.0])
    assert normal_above(z).tolist() == stats.norm.sf(z).tolist()
    assert normal_at(1e-4) == stats.norm.isf(1e-4)


@pytest.mark.parametrize("count", [1, 2, 9, 40])
def test_false_discoveries_are_controlled_as_scipy_does(count: int) -> None:
    p = np.random.default_rng(count).uniform(size=count) ** 3
    assert false_discoveries(p) == pytest.approx(stats.false_discovery_control(p), rel=1e-15)
