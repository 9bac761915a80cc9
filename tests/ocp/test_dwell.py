"""Valves that dwell: rounding fills in short pulses, the phases' program bounds their length."""

import numpy as np
import pytest

from kemba.ocp.relaxation.session import dwelling

H = np.full(20, 2e-3)  # s
LEAST = 0.01  # s


def pulse(first: int, count: int, inverted: bool = False) -> np.ndarray:
    """A valve (21,) that is on (or, `inverted`, off) for `count` steps from node `first`."""
    u = np.zeros(21)
    u[first : first + count] = 1.0
    return 1.0 - u if inverted else u


@pytest.mark.parametrize("inverted", [False, True])
@pytest.mark.parametrize(("count", "stays"), [(1, False), (3, False), (4, False), (5, True)])
def test_only_pulses_as_long_as_the_dwell_stay(count: int, stays: bool, inverted: bool) -> None:
    """5 steps of 2 ms are 10 ms; anything shorter is filled in, be it on or off."""
    u = pulse(6, count, inverted)
    filled = np.full(21, float(inverted))
    assert np.array_equal(dwelling(u, H, LEAST), u if stays else filled)


def test_the_length_is_that_of_the_steps_it_lasts() -> None:
    """The same nodes on shorter steps are too short."""
    h = H.copy()
    h[5:10] = 1.5e-3
    assert np.array_equal(dwelling(pulse(6, 5), h, LEAST), np.zeros(21))


def test_the_shortest_pulse_goes_first() -> None:
    """Of two short ones only the shorter goes, where the other then lasts long enough."""
    u = pulse(3, 4) + pulse(8, 6)  # 8 ms on, 2 ms off, 12 ms on
    assert np.array_equal(dwelling(u, H, LEAST), pulse(3, 11))


def test_values_between_are_rounded_first() -> None:
    assert np.array_equal(dwelling(0.2 + 0.6 * pulse(6, 5), H, LEAST), pulse(6, 5))


def test_what_is_no_number_comes_to_an_end() -> None:
    assert np.isnan(dwelling(np.full(21, np.nan), H, LEAST)).any()
