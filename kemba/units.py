"""Numbers with units, read by pint: `m.s-1`, `m/s^2`, `deg/100`, `10 ms`.

pint is imported only for a unit that is not among the `USUAL` ones: it takes a quarter of a second.
"""

from __future__ import annotations

import math
import re
from functools import lru_cache
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from kemba.errors import suggest

if TYPE_CHECKING:
    import numpy as np
    import pint

    Number = TypeVar("Number", float, np.ndarray)

NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
TOKEN = re.compile(
    r"(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(?:(?:\^|\*\*)(?P<exponent>[+-]?\d{1,2}(?!\d)))?"
    r"|(?P<symbol>[A-Za-zµμΩ°%]+)(?:(?:\^|\*\*)?(?P<power>[+-]?\d{1,2}(?!\d)))?"
    r"|(?P<operator>\s*[*/.·×]\s*|\s+)|(?P<bracket>[()])"
)
RAISED = re.compile("[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+")
LOWERED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
HEADER_UNIT = re.compile(r"1|[A-Za-z%]+(?:-?\d+)?(?:\.[A-Za-z%]+(?:-?\d+)?)*")
SI_SYMBOLS = frozenset("1 m s kg A K mol cd rad N Pa J W V C F Hz T H".split())
TORQUE = re.compile(r"([kMmuµ]?N)([mc]?m)")  # `Nm` is a textile unit to pint
COMMON = "m mm cm s ms min kg g N kN Pa kPa MPa bar psi rad deg K degC J W Hz rpm L".split()

# SI unit and size of the units that most files have; pint gives the same numbers to the last bit
USUAL = {
    "mm": ("m", 1e-3), "cm": ("m", 1e-2), "mm2": ("m2", 1e-6), "cm2": ("m2", 1e-4),
    "cm3": ("m3", 1e-2**3), "mL": ("m3", 1e-6), "L": ("m3", 1e-3), "ms": ("s", 1e-3),
    "m/s": ("m.s-1", 1.0), "g": ("kg", 1e-3), "kN": ("N", 1e3), "kPa": ("Pa", 1e3),
    "MPa": ("Pa", 1e6), "bar": ("Pa", 1e5), "%": ("1", 1e-2), "deg": ("rad", math.pi / 180),
}  # fmt: skip

VOCABULARY = Path(__file__).with_name("units.txt")

# SI unit of each of pint's dimensions
BASE = {
    "[length]": "m",
    "[time]": "s",
    "[mass]": "kg",
    "[temperature]": "K",
    "[current]": "A",
    "[substance]": "mol",
    "[luminosity]": "cd",
}

# What people call each unit, and an example of its size on a robot.
NAMES = {
    "1": ("number", "0.5"),
    "m": ("length", "0.5 m"),
    "m2": ("area", "4 cm2"),
    "m3": ("volume", "20 mL"),
    "s": ("time", "5 ms"),
    "kg": ("mass", "0.5 kg"),
    "rad": ("angle", "30 deg"),
    "m.s-1": ("speed", "0.5 m.s-1"),
    "m.s-2": ("acceleration", "9.81 m.s-2"),
    "rad.s-1": ("angular speed", "3 rad.s-1"),
    "s-1": ("rate", "3 s-1"),
    "N": ("force", "12 N"),
    "N.m": ("torque", "12 N.m"),
    "Pa": ("pressure", "7 bar"),
    "N.m-1": ("stiffness", "400 N.m-1"),
    "N.s.m-1": ("damping", "15 N.s.m-1"),
    "N.s2.m-2": ("quadratic damping", "40 N.s2.m-2"),
    "N.m.rad-1": ("rotary stiffness", "1.5 N.m.rad-1"),
    "N.m.s.rad-1": ("rotary damping", "0.1 N.m.s.rad-1"),
    "kg.m2": ("moment of inertia", "0.01 kg.m2"),
    "W": ("power", "50 W"),
    "K": ("temperature", "293 K"),
}


def to_si(value: float | int | str, unit: str) -> float:
    """`value` in the SI unit `unit`: `'5 mm'` and `0.005` are both 0.005 in `m`.

    Bare numbers are SI already. Raises ValueError, in words for the author of the file, when the
    value is not a finite number or has another dimension than `unit`.
    """
    if isinstance(value, str):
        number, written = _split(value.strip(), unit)
    elif isinstance(value, Real) and not isinstance(value, bool):
        number, written = float(value), ""
    else:
        raise ValueError(f"{_called(value)} is not a number; {expectation(unit)}")
    if not math.isfinite(number):
        raise ValueError(f"'{value}' is not a finite number; {expectation(unit)}")
    if written in ("", unit):
        return number
    try:
        return convert(number, written, unit)
    except ValueError as error:
        raise ValueError(f"'{value}' {error}") from None


def convert(value: Number, source_unit: str, target_unit: str) -> Number:
    """`value` (a float or an array of any shape) in `source_unit`, expressed in `target_unit`.
    Raises ValueError when a unit is unknown or the dimensions differ."""
    if source_unit == target_unit:
        return value
    si, size = USUAL.get(source_unit, ("", 1.0))
    if si == target_unit:
        return value * size
    (size, source), (divisor, target) = _parsed(source_unit), _parsed(target_unit)
    if source.dimensionality != target.dimensionality:
        named = called_dimension(source)
        named = f"in {source_unit}" if named.startswith("in ") else named
        raise ValueError(f"is {named}; {expectation(target_unit)}")
    if "rad" in target_unit and re.search(r"Hz\b", source_unit):
        raise ValueError("could mean turns or radians; write rpm or rad.s-1")
    scaled = value if size == 1.0 else value * size
    converted: Number = registry().Quantity(scaled, source).to(target).magnitude
    return converted if divisor == 1.0 else converted / divisor


def read_si(value: float | int | str) -> tuple[float, str]:
    """Number and SI unit of a value of any dimension: `'5 mm'` is (0.005, 'm'), 3 is (3.0, '1').
    Raises ValueError, in words for the author of the file."""
    if not isinstance(value, str):
        return to_si(value, "1"), "1"
    number, written = _split(value.strip(), "1")
    written = written or "1"
    if is_unit(written) and is_si(written):
        return to_si(number, written), written
    if written in USUAL:
        si = USUAL[written][0]
        return to_si(value, si), si
    si = si_name(parse_unit(written))
    return to_si(value, si), si


def si_name(unit: pint.Unit) -> str:
    """The SI unit of a unit's dimension as headers write it: `N.m`; angles keep their `rad`."""
    named = [u for u in NAMES if parse_unit(u).dimensionality == unit.dimensionality]
    same = (u for u in named if registry().Quantity(1, unit).to_root_units().units
            == registry().Quantity(1, parse_unit(u)).to_root_units().units)  # fmt: skip
    return (
        next(same, "")
        or next(iter(named), "")
        or ".".join(
            f"{BASE[dimension]}{power if power != 1 else ''}"
            for dimension, power in unit.dimensionality.items()
        )
    )


def called_dimension(unit: pint.Unit) -> str:
    """The everyday name of a unit's dimension with its article: `a length`."""
    name, _ = NAMES.get(si_name(unit), ("", ""))
    if not name:
        return f"in {unit:~C}"
    return f"an {name}" if name[0] in "aeiou" else f"a {name}"


def is_unit(text: str) -> bool:
    """Whether `text` follows the grammar of headers: symbols with powers, joined by dots."""
    return HEADER_UNIT.fullmatch(text) is not None


def is_si(unit: str) -> bool:
    """Whether every symbol of `unit` is an SI unit without a prefix (kg excepted)."""
    return all(symbol in SI_SYMBOLS for symbol in re.findall(r"[A-Za-z%]+", unit))


def expectation(unit: str) -> str:
    """What a value in `unit` looks like: `a length such as '0.5 m' was expected`."""
    name, example = NAMES.get(unit, (f"value in {unit}", f"1 {unit}"))
    article = "an" if name[0] in "aeiou" else "a"
    return f"{article} {name} such as '{example}' was expected"


@lru_cache(maxsize=1)
def registry() -> pint.UnitRegistry[Any]:
    """The one pint registry, of the units in units.txt, made when first needed."""
    import pint

    return pint.UnitRegistry(VOCABULARY, autoconvert_offset_to_baseunit=True)


def _split(text: str, unit: str) -> tuple[float, str]:
    """The number and the unit of `text`."""
    match = NUMBER.match(text)
    rest = text[match.end() :] if match else text
    if match and re.match(r",\d", rest):
        raise ValueError(f"'{text}' has a comma; write numbers with a point only, like '0.5 m'")
    if match is None or re.match(r"[\d.,_]|\s+(?!1\s*/)[\d.]", rest):
        raise ValueError(f"'{text}' is not a number with a unit; {expectation(unit)}")
    return float(match.group()), re.sub(r"^\s*/", "1/", rest).strip()  # `500 /min`, `1/3 m`


def parse_unit(text: str) -> pint.Unit:
    """The pint unit of `m.s-1`, `m/s`, `N m` or `m/s^2`, without its factor, if it has one. Raises
    ValueError where it is unreadable."""
    return _parsed(text)[1]


@lru_cache(maxsize=256)
def _parsed(text: str) -> tuple[float, pint.Unit]:
    """The factor and the pint unit of a text such as `deg/100`; products and quotients from the
    left, as pint reads them."""
    from pint.util import ParserHelper

    unreadable = f"has the unreadable unit '{text}'; units are written like m.s-1 or N.m"
    symbols: list[str] = []
    expression, end = "", 0
    plain = RAISED.sub(lambda m: "^" + m[0].translate(LOWERED), text.strip())
    for match in TOKEN.finditer(plain):
        if match.start() != end or (match["operator"] and expression[-1:] in ("", *"*/(")):
            break
        end = match.end()
        expression += _rewritten(match, symbols, expression)
    if not expression or end != len(plain):
        raise ValueError(unreadable)
    try:
        found = ParserHelper.from_string(expression)
        size = float(found.scale)  # type: ignore[arg-type]
    except Exception:  # pint raises anything on an expression that is none
        raise ValueError(unreadable) from None
    if not 0.0 < size < math.inf:
        raise ValueError(unreadable)
    unit = registry().Unit("")
    for name, power in found.items():
        for part in _parts(symbols[int(name[1:])]):
            unit *= _symbol(part) ** power
    return size, unit


def _rewritten(match: re.Match[str], symbols: list[str], before: str) -> str:
    """One token in pint's own syntax; symbols are numbered, since pint takes no `%` or `°`."""
    if match["operator"] is not None:
        return "/" if "/" in match["operator"] else "*"
    if match["bracket"] == ")":
        return ")"
    product = "*" if before and before[-1] not in "*/(" else ""
    if match["bracket"]:
        return product + "("
    if match["number"]:
        exponent = f"**{match['exponent']}" if match["exponent"] else ""
        return f"{product}{match['number']}{exponent}"
    symbols.append(match["symbol"])
    power = f"**{match['power']}" if match["power"] else ""
    return f"{product}u{len(symbols) - 1}{power}"


def _parts(symbol: str) -> tuple[str, ...]:
    """The units of a symbol such as `Nm`, in which two are run together."""
    match = TORQUE.fullmatch(symbol)
    return match.groups() if match else (symbol,)


def _symbol(name: str) -> pint.Unit:
    """The pint unit of one symbol; ValueError with the nearest one when there is none."""
    try:
        return registry().Unit({"%": "percent", "°": "deg"}.get(name, name))
    except (AttributeError, ValueError):  # pint's UndefinedUnitError is an AttributeError
        raise ValueError(f"has the unknown unit '{name}'; {suggest(name, COMMON)}") from None


def _called(value: object) -> str:
    """What a YAML author would call a value that is not a number."""
    names = {bool: "true/false", list: "a list", dict: "a group of keys", type(None): "nothing"}
    return names.get(type(value), f"'{value}'")


def short(value: float, digits: int = 2) -> str:
    """A number for a sentence: `160`, where the format `.2g` has `1.6e+02`."""
    return f"{float(f'{value:.{digits}g}'):.12g}"
