"""One short hop of the blind twin, simulated once."""

import pytest

pytest.importorskip("numba")

from twin.run import Truth, simulate
from twin.scripts import short_hop


@pytest.fixture(scope="session")
def hop() -> Truth:
    return simulate(short_hop())
