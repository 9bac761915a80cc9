"""Motion between the rows of a log."""

import numpy as np
import pytest

from kemba.identify.robot.state import _at


def test_between_two_rows_motion_is_a_straight_line() -> None:
    """In the first step and the last as well, and beyond them the line goes on."""
    time, values = np.array([0.0, 1.0, 3.0]), np.array([[0.0], [1.0], [9.0]])
    found = _at(time, values, np.array([-1.0, 0.0, 0.5, 1.0, 2.0, 3.0, 4.0]))
    assert found[:, 0] == pytest.approx([-1.0, 0.0, 0.5, 1.0, 5.0, 9.0, 13.0])
