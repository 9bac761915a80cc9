"""What the words and units in the names of columns say, and which four columns are a quaternion."""

import numpy as np
import pytest

from kemba.logs.draft.words import Names, named_unit, quaternions


@pytest.mark.parametrize(("norm", "turned"), [(1.0, 1), (1.019, 1), (1.021, 0), (0.979, 0)])
def test_four_columns_of_about_unit_norm_are_a_quaternion(norm: float, turned: int) -> None:
    """Of numbers that are rounded to two digits; its pitch does not depend on the norm."""
    half = np.linspace(0.0, 0.4, 50)
    parts = {"x": 0 * half, "y": np.sin(half), "z": 0 * half, "w": np.cos(half)}
    values = {f"base.q.{axis}": norm * part for axis, part in parts.items()}
    left, _, found = quaternions(values, Names(("front", "rear")))
    assert len(found) == turned
    for pitch in found:
        assert left[pitch] == pytest.approx(2 * half)


def test_a_unit_inside_a_name_is_taken_where_there_is_one() -> None:
    assert named_unit("pos_mm_front") == ("pos_front", "mm")
