"""Numbers with units, headers, and the metadata of schema fields."""

import math
import subprocess
import sys
from typing import Annotated

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel, ValidationError

from kemba.errors import KembaError
from kemba.quantity import Param, Quantity, convert, is_si, to_si
from kemba.units import USUAL, parse_unit, read_si, registry, short

FINITE = st.floats(-1e9, 1e9, allow_nan=False)
SEGMENT = st.text("abcdefghijklmnopqrstuvwxyzXYZ_0123456789", min_size=1, max_size=8)
UNIT = st.sampled_from(["1", "m", "m.s-1", "N.s2.m-2", "rad.s-1", "kg.m2", "Pa"])


@pytest.mark.parametrize(
    ("text", "unit", "expected"),
    [
        ("0.5 m", "m", 0.5),
        ("7 bar", "Pa", 7e5),
        ("0.7 MPa", "Pa", 7e5),
        ("5ms", "s", 0.005),
        ("30 deg", "rad", math.pi / 6),
        ("30 °", "rad", math.pi / 6),
        ("12 N.m", "N.m", 12.0),
        ("12 Nm", "N.m", 12.0),
        ("20 %", "1", 0.2),
        ("3 rpm", "rad.s-1", 0.1 * math.pi),
        ("20 degC", "K", 293.15),
        ("1 N s^2/m^2", "N.s2.m-2", 1.0),
        ("2 m/s", "m.s-1", 2.0),
        ("3 1/s", "s-1", 3.0),
        ("1e-3", "m", 0.001),
        ("5 m.s⁻¹", "m.s-1", 5.0),
        (".5 m", "m", 0.5),
        ("-3 mm", "m", -0.003),
        ("0.5 rad", "1", 0.5),
        (3, "m", 3.0),
    ],
)
def test_values_in_si(text: str, unit: str, expected: float) -> None:
    assert to_si(text, unit) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("unit", "si", "size"),
    [("1²", "1", 1.0), ("10³ Pa", "Pa", 1e3), ("cm²", "m2", 1e-4), ("10⁻³ m", "m", 1e-3)],
)
def test_raised_digits_are_powers(unit: str, si: str, size: float) -> None:
    assert convert(5.0, unit, si) == pytest.approx(5.0 * size)
    with pytest.raises(ValueError, match="unreadable unit"):
        convert(5.0, "(m)²", "m2")


@pytest.mark.parametrize(
    ("value", "unit", "message"),
    [
        ("0.5 kg", "m", "'0.5 kg' is a mass; a length such as '0.5 m' was expected"),
        ("5 N.m", "N", "'5 N.m' is a torque; a force such as '12 N' was expected"),
        ("5 m.s", "m", "'5 m.s' is in m.s; a length such as '0.5 m' was expected"),
        ("5 Mpa", "Pa", "'5 Mpa' has the unknown unit 'Mpa'; did you mean 'MPa'?"),
        ("0,5 m", "m", "'0,5 m' has a comma; write numbers with a point only, like '0.5 m'"),
        ("2 Hz", "rad.s-1", "'2 Hz' could mean turns or radians; write rpm or rad.s-1"),
        ("5 m)", "m", "'5 m)' has the unreadable unit 'm)'; units are written like m.s-1 or N.m"),
        ("nan", "m", "'nan' is not a number with a unit; a length such as '0.5 m' was expected"),
        (
            "1_0 m",
            "m",
            "'1_0 m' is not a number with a unit; a length such as '0.5 m' was expected",
        ),
        ("1e400 m", "m", "'1e400 m' is not a finite number; a length such as '0.5 m' was expected"),
        (math.inf, "1", "'inf' is not a finite number; a number such as '0.5' was expected"),
        (True, "m", "true/false is not a number; a length such as '0.5 m' was expected"),
        (None, "m", "nothing is not a number; a length such as '0.5 m' was expected"),
        ([1], "m", "a list is not a number; a length such as '0.5 m' was expected"),
    ],
)
def test_refusals_teach(value: object, unit: str, message: str) -> None:
    with pytest.raises(ValueError) as caught:
        to_si(value, unit)  # type: ignore[arg-type]
    assert str(caught.value) == message


@given(FINITE)
def test_a_prefix_only_scales(number: float) -> None:
    assert to_si(f"{number!r} mm", "m") == pytest.approx(number * 1e-3, rel=1e-12)


@given(FINITE)
def test_a_number_in_its_own_unit_is_exact(number: float) -> None:
    assert to_si(f"{number!r} m", "m") == number


def test_arrays_convert_for_foreign_columns() -> None:
    np.testing.assert_allclose(convert(np.array([1.0, 2.0]), "mm", "m"), [0.001, 0.002])
    with pytest.raises(ValueError, match="is a mass; a length"):
        convert(np.ones(2), "kg", "m")


@given(st.lists(SEGMENT, min_size=1, max_size=3), UNIT)
def test_headers_round_trip(path: list[str], unit: str) -> None:
    quantity = Quantity("/".join(path), unit)
    assert Quantity.from_header(quantity.header) == quantity


@pytest.mark.parametrize("text", ["", "z", "[m]", "z[m]", "a b [m]", "a/ [m]", "a [m/s]", "a [m] "])
def test_malformed_headers(text: str) -> None:
    with pytest.raises(KembaError, match="column header"):
        Quantity.from_header(text)


def test_si_units_have_no_prefix() -> None:
    assert is_si("N.s2.m-2") and is_si("kg.m2") and is_si("1")
    assert not is_si("mm") and not is_si("bar") and not is_si("deg.s-1")


class Friction(BaseModel):
    F_c: Annotated[float, Param("N", size=10.0, lower=0.0, doc="Coulomb force")]
    share: Annotated[float, Param("1", lower=0.0, upper=1.0)] = 0.5


def test_param_reads_units_and_holds_bounds() -> None:
    assert Friction(F_c="0.012 kN").F_c == pytest.approx(12.0)  # type: ignore[arg-type]
    with pytest.raises(ValidationError, match=r"'-1 N' is out of range; at least 0 N was expected"):
        Friction(F_c="-1 N")  # type: ignore[arg-type]
    with pytest.raises(ValidationError, match=r"0 to 1 was expected"):
        Friction(F_c=1, share=2)


def test_param_describes_itself_in_json_schema() -> None:
    assert Friction.model_json_schema()["properties"]["F_c"] == {
        "anyOf": [{"type": "number", "minimum": 0.0}, {"type": "string"}],
        "description": "Coulomb force [N]",
        "title": "F C",
        "unit": "N",
    }


def test_bare_numbers_cost_no_import() -> None:
    script = (
        "import sys; from kemba.quantity import to_si; to_si(3, 'm'); to_si('3 m', 'm');"
        "print(sorted({'pint', 'pydantic', 'numpy'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.stdout.strip() == "[]", done.stderr


def test_numbers_in_sentences_have_no_exponent() -> None:
    assert [short(v) for v in (160.4, 2.62, 0.0312, 36.0, 1e3)] == [
        "160",
        "2.6",
        "0.031",
        "36",
        "1000",
    ]
    assert short(1.2345, 3) == "1.23"


@pytest.mark.parametrize("name", USUAL)
def test_usual_units_are_those_of_pint_to_the_last_bit(name: str) -> None:
    si, size = USUAL[name]
    for number in (1.0, 0.7, 3.3, 412.9):
        exact = registry().Quantity(number, parse_unit(name)).to(parse_unit(si)).magnitude
        assert number * size == exact
        assert convert(number, name, si) == exact
        assert read_si(f"{number} {name}") == (exact, si)


SYMBOLS = ("m", "mm", "s", "ms", "kg", "g", "N", "kN", "bar", "Pa", "deg", "rad", "min", "L", "V")
part = st.tuples(
    st.sampled_from((".", "*", "/", " ", " / ", "·")),
    st.one_of(
        st.tuples(st.sampled_from(SYMBOLS), st.sampled_from((1, 1, 2, 3, -1, -2))),
        st.tuples(st.sampled_from(("10", "100", "0.1", "1e-3", "1000", "4096")), st.just(1)),
    ),
)


@given(st.lists(part, min_size=1, max_size=5), st.booleans())
def test_any_unit_means_what_pint_reads_in_it(parts: list[tuple], marked: bool) -> None:
    """Factors of a unit count wherever they stand; the oracle is pint's own parser."""
    ours, theirs = "", ""
    for i, (operator, (symbol, power)) in enumerate(parts):
        operator = "*" if operator == "." and symbol[0].isdigit() else operator
        mark = "**" if marked or symbol[0].isdigit() else ""
        ours += (operator if i else "") + symbol + (f"{mark}{power}" if power != 1 else "")
        theirs += ("/" if "/" in operator else "*") if i else ""
        theirs += symbol + (f"**({power})" if power != 1 else "")
    expected = registry().Quantity(1.0, "").units * registry().parse_expression(theirs)
    base = expected.to_base_units()
    unit = f"{base.units:~D}".replace(" ", "") or "1"
    assert convert(1.0, ours, unit) == pytest.approx(base.magnitude, rel=1e-12)
    if not ours[0].isdigit():
        assert to_si(f"3 {ours}", unit) == pytest.approx(3 * base.magnitude, rel=1e-12)


@pytest.mark.parametrize(
    "unit", ["m/0", "m//s", "m..s", "m^999", "(m", "m)", "/", "m/", "2^99.m^-"]
)
def test_what_is_no_unit_is_refused(unit: str) -> None:
    with pytest.raises(ValueError, match="unreadable unit"):
        convert(1.0, unit, "m")
