"""What the words and units in the names of columns say, and which four columns are a quaternion."""

import numpy as np
import pytest

from kemba.logs.draft.words import Names, named_unit, quaternions, strange_unit


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


@pytest.mark.parametrize(
    ("form", "found"), [("xyzw", 1), ("XYZW", 1), ("wxyz", 1), ("0123", 0), ("1230", 1)]
)
def test_the_order_of_a_quaternion_is_told_by_its_names(form: str, found: int) -> None:
    """In the order x, y, z, w. Of numbers, w is the first, unless the values say otherwise."""
    half = np.linspace(0.0, 0.4, 50)
    parts = 0 * half, np.sin(half), 0 * half, np.cos(half)
    order = dict(zip("xyzw", parts, strict=True))
    values = {
        f"base.q{axis}": order.get(axis.lower(), part)
        for axis, part in zip(form, parts, strict=True)
    }
    left, _, turned = quaternions(values, Names(("front", "rear")))
    assert len(turned) == found
    for pitch in turned:
        assert left[pitch] == pytest.approx(2 * half)


@pytest.mark.parametrize("unit", ["°/100", "0.01°", "deg/100", "%/10"])
def test_a_factor_before_or_behind_a_sign_is_part_of_the_unit(unit: str) -> None:
    assert named_unit(f"pitch [{unit}]") == ("pitch", unit)


@pytest.mark.parametrize("text", ["'", '"', "1/100", "10^-3", "counts", "°_10"])
def test_what_looks_like_a_unit_and_is_none_is_told(text: str) -> None:
    assert named_unit(f"hip [{text}]")[1] is None and strange_unit(f"hip [{text}]", ()) == text


@pytest.mark.parametrize("text", ["", "-", "0", "#1", "body", "1:3"])
def test_a_place_or_a_remark_in_brackets_is_no_unit(text: str) -> None:
    assert named_unit(f"hip [{text}]")[1] is None and strange_unit(f"hip [{text}]", ()) is None


@pytest.mark.parametrize(
    "name", ["force (filtered) [N]", "pressure [bar] (gauge)", "x [counts] [mm]"]
)
def test_beside_a_known_unit_nothing_is_strange(name: str) -> None:
    assert strange_unit(name, ("front", "rear")) is None


def test_a_unit_inside_a_name_is_taken_where_there_is_one() -> None:
    assert named_unit("pos_mm_front") == ("pos_front", "mm")


@pytest.mark.parametrize(
    ("name", "bare", "unit"),
    [
        ("Kraft in kN", "Kraft", "kN"), ("v / mm/s", "v", "mm/s"), ("Force, kN", "Force", "kN"),
        ("Force - kN", "Force", "kN"), ("F/kN", "F", "kN"), ("t/s", "t", "s"),
        ("Winkel/°", "Winkel", "deg"), ("Force kN", "Force", "kN"), ("Time:s", "Time", "s"),
        ("pos.mm", "pos", "mm"), ("Force <kN>", "Force", "kN"), ("Force {kN}", "Force", "kN"),
        ("positionMm", "position", "mm"), ("forceKN", "force", "kN"), ("hipDeg", "hip", "deg"),
        ("p_kgf/cm2", "p", "kgf/cm2"), ("force/mN", "force", "mN"),
        ("TORQUE_MNM", "TORQUE", "mN.m"), ("torque [ft-lb]", "torque", "lbf.ft"),
    ],
)  # fmt: skip
def test_a_unit_stands_behind_a_name_in_any_way(name: str, bare: str, unit: str) -> None:
    assert named_unit(name) == (bare, unit)


@pytest.mark.parametrize(
    "name",
    ["front/hip/q", "body/z", "/robot/m", "robot/leg/N", "valve_front_in", "valve front in",
     "Pressure min", "hip V", "joint.m", "Piston, front", "body / z", "rod in 1", "cylPosR",
     "Force - foot"],
)  # fmt: skip
def test_a_path_a_side_or_a_letter_is_no_unit(name: str) -> None:
    assert named_unit(name) == (name, None)
