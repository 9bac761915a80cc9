"""Model YAML (configs/models/*.yaml): a robot or rig, a supply pressure, a list of effects."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from kemba.config import find_config, load_yaml, parse
from kemba.effects import AnyEffect, Effect
from kemba.effects.catalogue import CHAMBERS
from kemba.mechanism import rig_mechanism, robot_mechanism
from kemba.model.model import Model
from kemba.quantity import Param

Supply = Annotated[float, Param("Pa", 0.1e6, lower=0.6e6, upper=0.8e6, doc="supply pressure")]


class ModelSpec(BaseModel):
    """A model as its YAML writes it.

    `base` names another model whose effects come first; one of the same name replaces it.
    `chambers: orifice` swaps the first-order chambers for eq. 1-3.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str = "model"
    base: str | None = None
    robot: str | None = None
    supply: Supply | None = None
    chambers: Literal["first_order", "orifice"] | None = None
    effects: tuple[AnyEffect, ...] = Field(default=())
    notes: str = ""


def load_spec(name: str | Path = "planning") -> ModelSpec:
    """The model YAML `name` (a path or a shipped model) with its bases merged in."""
    path = find_config(str(name), "models")
    spec = parse(load_yaml(path), ModelSpec)
    if spec.base is None:
        return spec
    base = load_spec(_near(path, spec.base))
    merged = {e.name: e for e in (*base.effects, *spec.effects)}
    update: dict[str, Any] = {
        key: getattr(spec, key) or getattr(base, key) for key in ("robot", "supply", "chambers")
    }
    return spec.model_copy(update={**update, "base": None, "effects": tuple(merged.values())})


def _near(path: Path, base: str) -> str | Path:
    beside = path.parent / (base if base.endswith(".yaml") else f"{base}.yaml")
    return beside if beside.exists() and beside != path else base


def build_model(
    spec: ModelSpec,
    extra: Iterable[Effect] = (),
    supply: float | None = None,
    rig: bool = False,
) -> Model:
    """The model of a spec: `extra` effects added, `supply` [Pa] overriding the spec's.

    `rig`: the same effects on the bench piston; those whose ports it lacks stay away.
    """
    mechanism = rig_mechanism() if rig else robot_mechanism(spec.robot or "kemba")
    effects: list[Effect] = [*spec.effects, *CHAMBERS[spec.chambers or "first_order"]()]
    named = {e.name: e for e in (*effects, *spec.effects)}
    listed = [*named.values()]
    if rig:
        listed = [e for e in listed if set(e.ports) <= {"piston"} and e.kind != "end_stop"]
    named = {e.name: e for e in (*listed, *extra)}
    return Model(mechanism, named.values(), supply or spec.supply or 0.7e6, spec.name)


def load_model(
    name: str | Path = "planning",
    extra: Iterable[Effect] = (),
    supply: float | None = None,
    rig: bool = False,
) -> Model:
    """Load and build in one step. Raises KembaError with every mistake of the YAML."""
    return build_model(load_spec(name), extra, supply, rig)
