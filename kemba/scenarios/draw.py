"""A file of uncertainties, and the scenarios drawn from it."""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import NormalDist
from typing import Annotated, Any
from zlib import crc32

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from kemba.config import Document, FileName, Section, find_config, load_yaml, parse
from kemba.errors import KembaError
from kemba.model import Model
from kemba.scenarios.conditions import (
    Conditions,
    Draws,
    Spread,
    Value,
    changed_effects,
    start_offsets,
)
from kemba.units import read_si, to_si

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
    """`count` scenarios of the uncertainties `name` on a plant, by Latin hypercube sampling.

    Raises KembaError where a key does not fit the plant.
    """
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
