"""Uncertain conditions: their YAML, and models and starts under them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from kemba.config import Section, parse
from kemba.effects import Effect
from kemba.effects.catalogue import BY_KIND
from kemba.effects.mechanics.load import Payload
from kemba.errors import KembaError, suggest
from kemba.events import STANDS
from kemba.model import Model
from kemba.model.spec import Supply
from kemba.plant.replay import first_row
from kemba.quantity import Param, to_si
from kemba.trajectory import Trajectory
from kemba.units import read_si

Value = float | str


class Spread(Section):
    """How a value is drawn: uniformly from `low` to `high`, normally about `mean` with `sigma`,
    or as one of `values`, as a bare list means. `whole`: whole numbers, both ends included.
    """

    low: Value | None = None
    high: Value | None = None
    mean: Value | None = None
    sigma: Value | None = None
    values: tuple[Value, ...] = ()
    whole: bool = False

    @model_validator(mode="before")
    @classmethod
    def _bare(cls, data: Any) -> Any:
        return {"values": data} if isinstance(data, list) else data

    @model_validator(mode="after")
    def _one_form(self) -> Spread:
        uniform = self.low is not None and self.high is not None
        normal = self.mean is not None and self.sigma is not None
        given = {key for key in ("low", "high", "mean", "sigma") if getattr(self, key) is not None}
        if uniform + normal + bool(self.values) != 1 or len(given) not in (0, 2):
            raise ValueError("either low and high, or mean and sigma, or values were expected")
        units = {read_si(value)[1] for value in self.ends}
        if len(units) > 1:
            raise ValueError(f"mixes units: {' and '.join(sorted(units))}")
        if uniform and read_si(self.ends[0])[0] > read_si(self.ends[1])[0]:
            raise ValueError(f"low {self.low} is above high {self.high}")
        if self.whole and not uniform:
            raise ValueError("'whole' goes with low and high")
        return self

    @property
    def ends(self) -> tuple[Value, ...]:
        """The two numbers of a distribution; none for values."""
        pairs = ((self.low, self.high), (self.mean, self.sigma))
        return next(((a, b) for a, b in pairs if a is not None and b is not None), ())


class GainSet(Section):
    """Gains of the hips' controller (paper, eq. 10)."""

    K_p: Annotated[float, Param("N.m.rad-1", lower=0.0)] = 150.0
    K_d: Annotated[float, Param("N.m.s.rad-1", lower=0.0)] = 4.0


class Conditions(Section):
    """The conditions under which a plan is executed.

    `effects` by kind, with the parameters that differ from the plant's. `start`: how far the
    robot starts from the plan's first pose, by coordinate; its lower foot stays on the ground.
    `jitter`: standard deviation of every switching's time, drawn by `seed`. `after`: how long the
    last commands are held.
    """

    supply: Supply | None = None
    payload: Annotated[float, Param("kg", lower=0.0)] = 0.0
    jitter: Annotated[float, Param("s", lower=0.0, upper=0.05)] = 0.0
    seed: Annotated[int, Field(ge=0)] = 0
    after: Annotated[float, Param("s", lower=0.0, upper=5.0)] = 0.0
    gains: GainSet = Field(default_factory=GainSet)
    effects: dict[str, dict[str, Value]] = Field(default_factory=dict)
    start: dict[str, Value] = Field(default_factory=dict)


class Draws(Section):
    """Values by key. `grid`: every combination of these lists. `vary`: each combination gets the
    same `cases` draws of these spreads.
    """

    grid: dict[str, tuple[Value, ...]] = Field(default_factory=dict)
    vary: dict[str, Spread] = Field(default_factory=dict)
    sampling: Literal["latin_hypercube", "random"] = "latin_hypercube"
    cases: Annotated[int, Field(ge=1, le=100_000)] = 1

    @model_validator(mode="after")
    def _apart(self) -> Draws:
        for key in sorted(set(self.grid) & set(self.vary)):
            raise ValueError(f"'{key}' stands in grid and in vary")
        if self.cases > 1 and not self.vary:
            raise ValueError(f"asks for {self.cases} cases, but 'vary' says nothing")
        for key, values in self.grid.items():
            if not values:
                raise ValueError(f"grid.{key} has no values")
        return self


def changed_effects(model: Model, conditions: Conditions) -> list[Effect]:
    """The effects that differ from the plant's. Raises KembaError for unknown kinds."""
    changed: list[Effect] = [Payload(m=conditions.payload)] if conditions.payload else []
    for kind, parameters in conditions.effects.items():
        if kind not in BY_KIND:
            raise KembaError(f"effects.{kind}", "no such effect", hint=suggest(kind, BY_KIND))
        listed = next((e for e in model.effects if e.name == kind), None)
        own = listed.model_dump() if listed else {}
        try:
            changed.append(parse({**own, "kind": kind, **parameters}, BY_KIND[kind]))
        except KembaError as error:
            raise KembaError(f"effects.{kind}", error.what, error.expected, error.hint) from None
    return changed


def start_offsets(model: Model, conditions: Conditions) -> dict[str, float]:
    """Offsets of the first pose in SI units. Raises KembaError for what is no coordinate."""
    mechanism = model.mechanism
    knees = {f"{leg}/knee/q" for leg in mechanism.legs}  # their pistons are easier to picture
    units = {c.name: c.unit for c in mechanism.coordinates if c.name not in knees}
    units |= {f"{leg}/piston/x": "m" for leg in mechanism.legs}
    offsets = {}
    for name, value in conditions.start.items():
        if name not in units:
            raise KembaError(f"start.{name}", "no such coordinate", hint=suggest(name, units))
        try:
            offsets[name] = to_si(value, units[name])
        except ValueError as error:
            raise KembaError(f"start.{name}", str(error)) from None
    return offsets


def standing(model: Model, table: Trajectory, offsets: Mapping[str, float]) -> dict[str, float]:
    """The table's first pose, moved; a lower foot that stands is put on the ground again."""
    from kemba.plant.simulate import initial_values, lowest_foot

    if not offsets:
        return {}
    pose = first_row(model, table)
    moved = {name: pose.get(name, 0.0) + offset for name, offset in offsets.items()}
    if lowest_foot(model, pose) > STANDS:
        return moved  # it is dropped: held in the air as the table says
    q, *_ = initial_values(model, pose | moved)
    height = q[[c.name for c in model.mechanism.coordinates].index("body/z")]
    lowest = lowest_foot(model, pose | moved)
    return moved | {"body/z": float(height - lowest)}
