"""Uncertain conditions: their YAML, the scenarios drawn from it, models and starts under them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import NormalDist
from typing import Annotated, Any, Literal
from zlib import crc32

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from kemba.config import Document, FileName, Section, find_config, load_yaml, parse
from kemba.effects import Effect
from kemba.effects.catalogue import BY_KIND
from kemba.effects.mechanics.load import Payload
from kemba.errors import KembaError, suggest
from kemba.events import STANDS
from kemba.model import Model
from kemba.model.spec import Supply
from kemba.plant.controller import Gains
from kemba.plant.replay import first_row
from kemba.plant.simulate import initial_values, lowest_foot
from kemba.quantity import Param
from kemba.trajectory import Trajectory
from kemba.units import read_si, to_si

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
    gains: Gains = Field(default_factory=Gains)
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


Array = NDArray[np.float64]
Values = dict[str, Value]


def sample(block: Draws, name: str, seed: int) -> list[Values]:
    """The values of every case: each point of the grid with the same draws of what varies."""
    points = [
        dict(zip(block.grid, p, strict=True)) for p in itertools.product(*block.grid.values())
    ]
    draws = _draws(block, np.random.default_rng([seed, crc32(name.encode())]))
    return [{**point, **draw} for point in points for draw in draws]


def _draws(block: Draws, rng: np.random.Generator) -> list[Values]:
    width = len(block.vary)
    if not width:
        return [{}]
    if block.sampling == "latin_hypercube":
        table = latin_hypercube(rng, block.cases, width)
    else:
        table = rng.random((block.cases, width))
    spreads = block.vary.items()
    return [
        {key: drawn(spread, float(u)) for (key, spread), u in zip(spreads, row, strict=True)}
        for row in table
    ]


def latin_hypercube(rng: np.random.Generator, count: int, width: int) -> Array:
    """Points (count, width) in [0, 1), in every column one in each of `count` equal parts.

    The points of `scipy.stats.qmc.LatinHypercube`, whose import takes half a second of a plan.
    """
    own = rng.spawn(1)[0]
    within = own.random((count, width))
    parts = np.tile(np.arange(1, count + 1), (width, 1))
    for column in parts:
        own.shuffle(column)
    return np.asarray((parts.T - within) / count)


def drawn(spread: Spread, u: float) -> Value:
    """The value of a spread at the quantile `u` in [0, 1), six digits, with its unit."""
    if spread.values:
        return spread.values[int(u * len(spread.values))]
    (a, unit), (b, _) = (read_si(value) for value in spread.ends)
    if spread.whole:
        return min(math.floor(a + (b - a + 1) * u), math.floor(b))
    if spread.mean is not None:
        number = a + b * NormalDist().inv_cdf(min(max(u, 1e-9), 1 - 1e-9))
    else:
        number = a + (b - a) * u
    short = float(f"{number:.6g}")
    return short if unit == "1" else f"{short:.6g} {unit}"


EACH = "start.*/"  # such a key is drawn for every leg by itself


class Uncertainties(Section):
    """What may differ between executions, as the `vary` of a sweep's block.

    `supply` is a share of the task's, `payload` comes on top of the task's. `start.*/...` stands
    for one key for every leg. The same `seed` gives the same scenarios.
    """

    name: FileName = "uncertainties"
    notes: str = ""
    seed: Annotated[int, Field(ge=0)] = 0
    vary: Annotated[dict[str, Spread], Field(min_length=1)]


@dataclass(frozen=True)
class Scenario:
    """One draw: the values by key, the model that they make, offsets of the first pose (SI)."""

    values: Mapping[str, Value]
    model: Model
    start: Mapping[str, float]

    @property
    def sentence(self) -> str:
        """The values in words."""
        return ", ".join(f"{key} {value}" for key, value in self.values.items())


def load_uncertainties(name: str | Path) -> tuple[Uncertainties, Document]:
    """The file of uncertainties `name` (a path or a shipped one). Raises KembaError."""
    document = load_yaml(find_config(name, "uncertainties"))
    return parse(document, Uncertainties), document


def scenarios(name: str | Path, plant: Model, count: int) -> list[Scenario]:
    """`count` scenarios of the uncertainties `name` on a plant, by Latin hypercube sampling. Raises
    KembaError where a key does not fit the plant."""
    asked, document = load_uncertainties(name)
    vary: dict[str, Spread] = {}
    for key, spread in asked.vary.items():
        legs = plant.mechanism.legs if key.startswith(EACH) else ("",)
        vary |= {key.replace("*", leg, 1) if leg else key: spread for leg in legs}
    draws = sample(Draws(vary=vary, cases=count), asked.name, asked.seed)
    try:
        return [_scenario(plant, values) for values in draws]
    except KembaError as error:
        where = f"{document.source or asked.name}: {error.where}"
        raise KembaError(where, error.what, error.expected, error.hint) from None


def _scenario(plant: Model, values: Mapping[str, Value]) -> Scenario:
    nested: dict[str, Any] = {}
    for key, value in values.items():
        if key not in ("supply", "payload"):
            *path, last = key.split(".")
            inner = nested
            for part in path:
                inner = inner.setdefault(part, {})
            inner[last] = value
    conditions = parse(Document(nested), Conditions)
    own = next((e.value("m") for e in plant.effects if e.kind == "payload"), 0.0)
    load = own + to_si(values.get("payload", 0.0), "kg")
    supply = plant.supply * (1.0 + to_si(values.get("supply", 0.0), "1"))
    base = Model(plant.mechanism, plant.effects, supply, plant.name)
    conditions = conditions.model_copy(update={"payload": load})
    model = base.with_effects(changed_effects(base, conditions))
    return Scenario(values, model, start_offsets(model, conditions))
