"""The contract of an effect: its fields are its parameters, one method gives its physics."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Protocol

import casadi as ca
from pydantic import BaseModel, ConfigDict, Field, field_validator
from typing_extensions import Self

from kemba.quantity import Param, Quantity, Tolerance

# 1 sigma as a share: an effect found by an earlier discovery is less certain
REMEASURED = Tolerance(0.1, source="assumed: a discovery from a few logs is that sure of a size")

if TYPE_CHECKING:
    from kemba.mechanism import Bore, Cylinder
    from kemba.scene import Ground


@dataclass(frozen=True)
class PortAt:
    """A port's position, velocity and acceleration as an effect sees them."""

    x: ca.SX
    v: ca.SX
    a: ca.SX


@dataclass(frozen=True)
class Pair:
    """Complementarity 0 <= a _|_ b >= 0, declared once and relaxed or solved per reader."""

    name: str
    a: ca.SX
    b: ca.SX
    unit_a: str = "m"
    unit_b: str = "N"


@dataclass(frozen=True)
class Signal:
    """What an effect does to a signal that others read: a gain, or a lagged value in its place."""

    gain: Any = 1.0
    lagged: ca.SX | None = None


@dataclass(frozen=True)
class Contribution:
    """What one effect adds at one place.

    effort: per port [N or N.m], on the right-hand side; rate: time derivative of own states;
    add_rate: addition to the rate of another effect's state; pairs; limits: expressions >= 0;
    publish: values that other effects may read by symbol; outputs: columns of its own.
    """

    effort: Mapping[str, Any] = field(default_factory=dict)
    rate: Mapping[str, Any] = field(default_factory=dict)
    add_rate: Mapping[str, Any] = field(default_factory=dict)
    pairs: Iterable[Pair] = ()
    limits: Mapping[str, Any] = field(default_factory=dict)
    publish: Mapping[str, Any] = field(default_factory=dict)
    outputs: Iterable[tuple[Quantity, Any]] = ()


class At(Protocol):
    """What an effect sees: ports, own states, inputs and forces, signals, others' values.

    `at.piston`, `at.hip`, `at.foot_x`, `at.foot_z`, `at.body_x`, `at.body_z`, `at.pitch`
    and, on a drive, `at.axis` are ports; any other attribute is looked up by symbol, first at this
    leg, then at the robot.
    """

    ground: Ground  # its height, slope, normal and friction at any place
    supply: Any  # Pa; a symbol in simulations that share their equations, see `at_supply`
    gravity: float  # m.s-2
    body_mass: float  # kg, of the body link alone
    sign_speed: float  # m.s-1 or rad.s-1; the sign of a piston's or an axis' rate is smooth within
    piston: PortAt
    hip: PortAt
    foot_x: PortAt
    foot_z: PortAt
    body_x: PortAt
    body_z: PortAt
    pitch: PortAt
    axis: PortAt

    @property
    def cylinder(self) -> Bore:
        """The cylinder of every leg: bore, areas, stroke."""

    @property
    def stroke(self) -> float:
        """Stroke of the piston [m]."""

    @property
    def legs(self) -> list[At]:
        """Every leg, as its own effects see it (for effects of the whole robot)."""

    @property
    def sense(self) -> Any:
        """Direction in which the piston's seals slide, from -1 to 1."""

    def standing(self, name: str) -> float:
        """Value of a coordinate of this place in the standing pose, pistons retracted."""

    def source(self, signal: str) -> Any:
        """A signal before any lag: what the lagging effect itself follows."""

    def __getattr__(self, symbol: str) -> Any: ...


class Effect(BaseModel):
    """One piece of physics that a model can list.

    Subclasses declare parameters as annotated fields, variables by symbol (as the equation
    writes them) and `evaluate`. They know no solver, step size, file or plot. The `kind` in YAML is
    the name of the class in small letters, `hip_friction` for HipFriction, unless it is declared.
    `off` names the one parameter that switches an effect and the value at which it is absent;
    its other parameters are shapes, which matter only when it is on and default to a typical
    value. A parameter that may not change sign has a lower bound; the `size` of a scale is that
    of scale - 1.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: str = ""
    on: str | None = None
    # how an effect that was found is known; it is no physics, so dumps and hashes leave it out
    support: Literal["sure", "likely"] | None = Field(default=None, exclude=True)

    place: ClassVar[Literal["leg", "body"]] = "leg"
    family: ClassVar[str] = ""
    equation: ClassVar[str] = ""
    source: ClassVar[str] = ""
    ports: ClassVar[tuple[str, ...]] = ()
    reads: ClassVar[tuple[str, ...]] = ()  # signals with nominal value 1 that it multiplies in
    publishes: ClassVar[tuple[str, ...]] = ()
    carried_by: ClassVar[Mapping[str, str]] = {}  # published value: the own state that moves it
    off: ClassVar[Mapping[str, float]] = {}
    own_rigs: ClassVar[bool] = False  # True: looked for as missing on rigs of the user's own only
    needs: ClassVar[tuple[str, ...]] = ()  # published values without which it cannot be missing
    replaces: ClassVar[tuple[str, ...]] = ()  # kinds that this one replaces in a model
    law_of: ClassVar[str] = ""  # of laws of one thing, an answer names one
    mirror: ClassVar[Mapping[str, str]] = {}  # symbols that change sign or name in the mirror
    dissipative: ClassVar[bool] = False
    moves: ClassVar[bool] = True  # False: in what is measured only; plans and simulations ignore it
    nominal: ClassVar[Mapping[str, Tolerance]] = {}  # figures that differ from machine to machine
    on_rod: ClassVar[bool] = True  # False: a force sensor at the rod does not measure its effort

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if "kind" not in cls.__annotations__:
            kind = re.sub(r"(?<!^)(?=[A-Z])", "_", cls.__name__).lower()
            cls.__annotations__ = {**cls.__annotations__, "kind": Literal[kind]}
            cls.kind = kind

    @field_validator("on")
    @classmethod
    def _one_leg(cls, on: str | None) -> str | None:
        if on is not None and cls.place == "body":
            raise ValueError("it acts on the whole robot, not on one leg; leave `on` out")
        return on

    def states(self) -> dict[str, Quantity]:
        """Own states by symbol."""
        return {}

    def inputs(self) -> dict[str, Quantity]:
        """Commands by symbol."""
        return {}

    def forces(self) -> dict[str, Quantity]:
        """Own algebraic unknowns by symbol, e.g. contact forces."""
        return {}

    def signals(self, at: At) -> dict[str, Signal]:
        """What it does to signals; may read own states and parameters only."""
        return {}

    def timing(self) -> dict[str, float]:
        """Seconds by which valves switch `on` and `off` later than commanded."""
        return {}

    def evaluate(self, at: At) -> Contribution:
        """Efforts, rates, pairs, limits at one place."""
        return Contribution()

    @property
    def geometry(self) -> Mapping[str, Any]:
        """Lengths and masses of the mechanism that it changes: part -> true minus nominal."""
        return {}

    def readings(self) -> Iterable[Any]:
        """What it makes sensors show wrongly, as faults of sensors."""
        return ()

    @property
    def leg(self) -> str | None:
        """The one leg it is restricted to."""
        return self.on

    @property
    def name(self) -> str:
        """Unique name within a model: the kind, and the leg where it is not on both."""
        return f"{self.kind}:{self.on}" if self.on else self.kind

    @classmethod
    @cache  # asked for at every prediction
    def declared(cls) -> dict[str, Param]:
        """Scalar parameters of the kind by field name."""
        found = {}
        for name, info in cls.model_fields.items():
            params = [m for m in info.metadata if isinstance(m, Param)]
            if params and info.annotation in (float, float | None):
                found[name] = params[0]
        return found

    def parameters(self) -> dict[str, Param]:
        """Scalar parameters of this effect by name."""
        return self.declared()

    def tables(self) -> dict[str, tuple[float, ...]]:
        """Figures of several numbers each that differ from machine to machine, by name."""
        figures = {name: self.value(name) for name in self.nominal}
        return {name: value for name, value in figures.items() if isinstance(value, tuple)}

    def tolerances(self) -> dict[str, float]:
        """1 sigma, as a share of the value, of figures that differ a little between machines of
        the same make; the entries of a table as `fill[0]`.

        These are the `nominal` ones. An effect that a plain machine lacks was found by an earlier
        discovery; its switch has a wider tolerance. Delays are left out: they shift events in
        time.
        """
        found: dict[str, float] = {}
        for name, tolerance in self.nominal.items():
            value = self.value(name)
            if tolerance.each:
                found |= {f"{name}[{i}]": tolerance.share(x) for i, x in enumerate(value)}
            else:
                middle = value[len(value) // 2] if isinstance(value, tuple) else value
                found[name] = tolerance.share(middle)
        if self.off and self.moves and all(p.unit != "s" for p in self.parameters().values()):
            found |= {name: REMEASURED.share(1.0) for name in self.off}
        return found

    def shapes(self) -> tuple[str, ...]:
        """Parameters that matter only when the effect is on."""
        return tuple(name for name in self.parameters() if name not in self.off) if self.off else ()

    def value(self, name: str) -> Any:
        """Value of the parameter `name`."""
        return getattr(self, name)

    def bind(self, values: Mapping[str, Any]) -> Effect:
        """The same effect with parameters replaced, by numbers or by symbols, unchecked."""
        return self.model_copy(update=dict(values))

    def of_cylinder(self, cylinder: Cylinder) -> Self:
        """The same effect; figures that are None are taken from the cylinder."""
        return self

    def remarks(self, supply: float) -> list[str]:
        """Remarks on the figures at this supply pressure [Pa]. Raises KembaError where the
        pressure is physically impossible."""
        return []

    def listed(self) -> dict[str, Any]:
        """The effect as an item of a model's YAML list."""
        values = self.model_dump(mode="json", by_alias=True, exclude_defaults=True)
        support = {"support": self.support} if self.support else {}
        return {"kind": self.kind, **values, **support}


class Deviation(Effect):
    """Physics that a machine may have beyond the planning model: a candidate of identification.

    Unless `off` says otherwise its first parameter switches it, and is at its default when absent.
    """

    @classmethod
    def __pydantic_init_subclass__(cls, **options: Any) -> None:
        if "off" not in cls.__dict__:
            cls.off = {name: cls.model_fields[name].default for name in [*cls.declared()][:1]}


class AirEffect(Deviation):
    """A deviation of the air between supply and chambers."""

    family = "air"
    ports: ClassVar[tuple[str, ...]] = ("piston",)


class PistonEffect(Deviation):
    """A deviation along the piston."""

    family = "piston"
    ports: ClassVar[tuple[str, ...]] = ("piston",)


class HipEffect(Deviation):
    """A deviation at the hip joint."""

    family = "hip"
    ports: ClassVar[tuple[str, ...]] = ("hip",)


class GroundEffect(Deviation):
    """A deviation of the ground under each foot."""

    family = "ground"
    ports: ClassVar[tuple[str, ...]] = ("foot_x", "foot_z")


class BodyEffect(Deviation):
    """A deviation of the body itself."""

    place = "body"
    family = "body"
    ports: ClassVar[tuple[str, ...]] = ("body_x", "body_z")


class BoomEffect(BodyEffect):
    """A deviation of the boom, as the body feels it."""

    family = "boom"


class AxisEffect(Deviation):
    """An effect at the axis of a drive: looked for on the user's own rigs only."""

    family = "drive"
    ports: ClassVar[tuple[str, ...]] = ("axis",)
    own_rigs = True
