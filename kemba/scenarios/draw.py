"""A file of uncertainties, and the scenarios drawn from it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from kemba.config import Document, FileName, Section, find_config, load_yaml, parse
from kemba.errors import KembaError
from kemba.model import Model
from kemba.scenarios.conditions import changed_effects, start_offsets
from kemba.scenarios.sampling import sample
from kemba.scenarios.schema import Conditions, Draws, Spread, Value
from kemba.units import to_si

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
