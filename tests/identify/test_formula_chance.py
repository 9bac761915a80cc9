"""How much evidence the best of many formulas needs before it is more than chance."""

from __future__ import annotations

import numpy as np
import pytest

from kemba.identify.doubt.unexplained import by_chance
from kemba.identify.settings import DiscoverSettings
from kemba.settings import changed


@pytest.mark.parametrize("width", [0.3, 1.0, 10.0])
def test_the_best_of_many_absent_terms_passes_less_often_than_a_p_value(width: float) -> None:
    """Columns of unit noise under a prior of `width` sigma: the log Bayes factor is known."""
    rng = np.random.default_rng(3)
    z = rng.standard_normal((20_000, 36))
    gain = 0.5 * z**2 * width**2 / (1.0 + width**2) - 0.5 * np.log(1.0 + width**2)
    false = np.mean(gain.max(axis=1) > by_chance(36))
    assert false <= DiscoverSettings.current().significant


def test_a_stricter_p_value_asks_for_more() -> None:
    usual = by_chance(36)
    with changed(DiscoverSettings, significant=0.01):
        assert by_chance(36) == pytest.approx(usual + np.log(2.0))
    assert by_chance(72) == pytest.approx(usual + np.log(2.0))
