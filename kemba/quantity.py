"""Quantities: every number that has a name and a unit outside the code."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from kemba.errors import KembaError
from kemba.units import convert, expectation, is_si, is_unit, to_si

if TYPE_CHECKING:
    from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
    from pydantic_core import CoreSchema

__all__ = ["Param", "Quantity", "Tolerance", "convert", "expectation", "is_si", "to_si"]

HEADER = re.compile(r"(?P<name>[^\s/,\[\]]+(?:/[^\s/,\[\]]+)*) \[(?P<unit>[^\[\]]+)\]")


@dataclass(frozen=True)
class Quantity:
    """A state, input, force, parameter, output or column: a name and what its number means.

    `lower`, `upper`, `scale` and `value` (the nominal one) are in `unit`, which is SI.
    """

    name: str
    unit: str = "1"
    lower: float = -math.inf
    upper: float = math.inf
    scale: float = 1.0
    value: float = 0.0
    doc: str = ""
    binary: bool = False

    @property
    def header(self) -> str:
        """The column header: `front/hip/tau [N.m]`."""
        return f"{self.name} [{self.unit}]"

    @classmethod
    def from_header(cls, text: str) -> Quantity:
        """The quantity of a column header such as `body/z [m]`. Raises KembaError where it is
        malformed."""
        match = HEADER.fullmatch(text)
        if match is None:
            raise KembaError(
                "", f"column header '{text}' is malformed", "'path/symbol [unit]' was expected"
            )
        if not is_unit(match["unit"]):
            what = f"column header '{text}' has the malformed unit '{match['unit']}'"
            raise KembaError("", what, "a unit such as [m.s-1], [N.m] or [1] was expected")
        return cls(match["name"], match["unit"])


@dataclass(frozen=True)
class Param:
    """What a number in a schema means: `F_c: Annotated[float, Param("N", size=10, lower=0)]`.

    pydantic then accepts `12 N`, `0.012 kN` or a bare SI number, refuses other dimensions and
    values outside `lower..upper`, and puts unit and `doc` into the JSON Schema. `size` is what
    would matter in practice, a prior width rather than a limit. Numbers are in `unit`.
    """

    unit: str = "1"
    size: float = 1.0
    lower: float = -math.inf
    upper: float = math.inf
    doc: str = ""
    rotary: str = ""

    def validate(self, value: Any) -> float:
        """`value` in `unit`. Raises ValueError where its dimension is another or it is out of
        bounds."""
        number = self._number(value)
        if not self.lower <= number <= self.upper:
            raise ValueError(f"'{value}' is out of range; {self.bounds} was expected")
        return number

    def _number(self, value: Any) -> float:
        try:
            return to_si(value, self.unit)
        except ValueError:
            if not self.rotary:
                raise
        return to_si(value, self.rotary)

    @property
    def bounds(self) -> str:
        """The admissible values in words."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        if math.isinf(self.upper):
            return f"at least {self.lower:g}{unit}"
        if math.isinf(self.lower):
            return f"at most {self.upper:g}{unit}"
        return f"{self.lower:g} to {self.upper:g}{unit}"

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        from pydantic_core import core_schema

        return core_schema.no_info_plain_validator_function(self.validate)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        limits = {"minimum": self.lower, "maximum": self.upper}
        number = {key: limit for key, limit in limits.items() if math.isfinite(limit)}
        unit = f"{self.unit} or {self.rotary}" if self.rotary else self.unit
        text = f"{self.doc} [{unit}]" if self.doc else f"[{unit}]"
        return {
            "anyOf": [{"type": "number", **number}, {"type": "string"}],
            "unit": self.unit,
            "description": text,
        }


@dataclass(frozen=True)
class Tolerance:
    """How much a nominal figure may differ on a machine of the same make.

    `sigma` (1 sigma) in `unit`: the figure's own, or "1" for a share of it. `each`: the entries of
    a table differ one by one, not all by one factor. `source`: where `sigma` comes from.
    """

    sigma: float
    unit: str = "1"
    each: bool = False
    source: str = ""

    def share(self, value: float) -> float:
        """1 sigma as a share of the figure's value."""
        return self.sigma if self.unit == "1" else self.sigma / abs(value)
