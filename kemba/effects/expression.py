"""An effect that its user writes as a formula with units."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import Field, PlainSerializer, PlainValidator, WithJsonSchema, model_validator

from kemba.effects.base import At, Contribution, Effect
from kemba.effects.formula import check_dimension, check_finite, evaluate, names_of, parse_formula
from kemba.errors import suggest
from kemba.quantity import Param
from kemba.units import read_si

# per port: unit of position, of rate, of the effort, and its own names for the two
PORTS: dict[str, tuple[str, str, str, tuple[str, ...]]] = {
    "piston": ("m", "m.s-1", "N", ()),
    "hip": ("rad", "rad.s-1", "N.m", ("q", "w")),
    "body_x": ("m", "m.s-1", "N", ()),
    "body_z": ("m", "m.s-1", "N", ("z",)),
    "pitch": ("rad", "rad.s-1", "N.m", ("q", "w")),
}
# values at which a formula must be finite: generous limits of such machines, and zero
TRIED: dict[str, dict[str, tuple[float, ...]]] = {
    "piston": {"x": (0.0, 0.05, 0.1), "v": (-5.0, -0.1, 0.0, 0.1, 5.0)},
    "hip": {"x": (-3.0, -0.5, 0.0, 0.5, 3.0), "v": (-60.0, -1.0, 0.0, 1.0, 60.0)},
    "body_x": {"x": (-10.0, 0.0, 10.0), "v": (-5.0, 0.0, 5.0)},
    "body_z": {"x": (0.0, 0.2, 2.0), "v": (-8.0, 0.0, 8.0)},
    "pitch": {"x": (-3.0, 0.0, 3.0), "v": (-20.0, 0.0, 20.0)},
}
TRIED_AT_LEG = {"u_e": (0.0, 1.0), "u_r": (0.0, 1.0), "F_e": (0.0, 500.0), "F_r": (0.0, 500.0),
                "tau": (-30.0, 0.0, 30.0)}  # fmt: skip
OF_LEG = {"u_e": "1", "u_r": "1", "F_e": "N", "F_r": "N", "tau": "N.m"}


class Constant(NamedTuple):
    """A parameter of a formula, in SI."""

    value: Any
    unit: str = "1"

    def __str__(self) -> str:
        number = repr(float(self.value))
        return number if self.unit == "1" else f"{number} {self.unit}"


Number = Annotated[
    Constant,
    PlainValidator(lambda v: v if isinstance(v, Constant) else Constant(*read_si(v))),
    PlainSerializer(str),
    WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "string"}]}),
]


class Expression(Effect):
    """A force written by the user as a formula; on an angle a torque.

    `on` is a port: piston, hip, body_x, body_z or pitch, `front/piston` for one leg. The formula
    may read the port's x and v (q and w on angles, z on body_z), at a leg u_e, u_r, F_e, F_r and
    tau, and its own parameters; + - * / **, exp, log, sqrt, tanh, sin, cos, tan, atan, abs, min,
    max. Every part is checked for its dimension.
    """

    called: str = Field(alias="name", pattern=r"^[A-Za-z]\w*$")
    on: str
    force: str
    constants: dict[str, Number] = Field(default_factory=dict, alias="parameters")

    family = "expression"
    equation = "force, added to the right-hand side of its port"
    source = "the user's own"

    @model_validator(mode="after")
    def _consistent(self) -> Expression:
        if not re.fullmatch(rf"(\w+/)?({'|'.join(PORTS)})", self.on):
            hint = suggest(self.on.split("/")[-1], PORTS)
            raise ValueError(f"no port '{self.on}'; {hint or ''}".rstrip("; "))
        if self.leg and self.place == "body":
            raise ValueError(f"'{self.port}' belongs to no leg; write 'on: {self.port}'")
        units = self.units()
        for name in self.constants:
            if name in units or not name.isidentifier():
                raise ValueError(f"the parameter '{name}' needs another name")
        units |= {name: constant.unit for name, constant in self.constants.items()}
        tree = parse_formula(self.force)
        read = names_of(tree)
        for name in sorted(read - set(units)):
            raise ValueError(f"'{self.force}' reads the unknown '{name}'; {suggest(name, units)}")
        for name in sorted(set(self.constants) - read):
            raise ValueError(f"the parameter '{name}' is not in '{self.force}'")
        check_dimension(tree, units, PORTS[self.port][2])
        check_finite(tree, self.ranges())
        return self

    @property
    def port(self) -> str:
        """The port it pushes on."""
        return self.on.split("/")[-1]

    @property
    def leg(self) -> str | None:
        return self.on.split("/")[0] if "/" in self.on else None

    @property
    def name(self) -> str:
        return f"{self.called}:{self.leg}" if self.leg else self.called

    @property
    def ports(self) -> tuple[str, ...]:  # type: ignore[override]
        return (self.port,)

    @property
    def place(self) -> Literal["leg", "body"]:  # type: ignore[override]
        return "leg" if self.port in ("piston", "hip") else "body"

    def units(self) -> dict[str, str]:
        """What the formula may read, with its unit."""
        position, rate, _, own = PORTS[self.port]
        units = {"x": position, "v": rate, **dict(zip(own, (position, rate), strict=False))}
        return units | (OF_LEG if self.place == "leg" else {})

    def ranges(self) -> dict[str, tuple[float, ...]]:
        """Values to try of everything that the formula may read, in SI."""
        motion = TRIED[self.port]
        own = dict(zip(PORTS[self.port][3], (motion["x"], motion["v"]), strict=False))
        constants = {name: (float(c.value),) for name, c in self.constants.items()}
        return {**motion, **own, **TRIED_AT_LEG, **constants}

    def parameters(self) -> dict[str, Param]:
        return {
            name: Param(constant.unit, abs(constant.value) or 1.0)
            for name, constant in self.constants.items()
        }

    def value(self, name: str) -> Any:
        return self.constants[name].value

    def bind(self, values: Mapping[str, Any]) -> Expression:
        bound = {
            name: c._replace(value=values.get(name, c.value)) for name, c in self.constants.items()
        }
        return self.model_copy(update={"constants": bound})

    def evaluate(self, at: At) -> Contribution:
        motion = getattr(at, self.port)
        own = PORTS[self.port][3]
        values = {
            "x": motion.x,
            "v": motion.v,
            **dict(zip(own, (motion.x, motion.v), strict=False)),
        }
        tree = parse_formula(self.force)
        for name in names_of(tree) - set(values):
            values[name] = (
                self.constants[name].value if name in self.constants else getattr(at, name)
            )
        return Contribution(effort={self.port: evaluate(tree, values)})
