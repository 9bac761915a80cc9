"""What the paper's own tables tell beside what they were made for."""

import pytest
from paper_tables import published


def test_the_papers_tables_tell_of_friction_supply_and_tubes() -> None:
    found = published()
    low, high = found.seal_friction
    assert 5.5 < low < high < 8.5
    assert found.losses["both"] == pytest.approx([6.1, 5.0, 7.8], abs=0.05)
    assert all(s[-1] > 0.08 > 0.01 > s[0] for s in found.shortfall.values())
    assert all(16e-6 < v < 19e-6 for v in found.dead_volume.values())
