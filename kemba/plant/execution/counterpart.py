"""The plant of a plan's own robot: full pneumatics, everything else as in the plan's model."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kemba.effects import Effect
from kemba.effects.catalogue import CHAMBERS
from kemba.effects.mechanics.load import Payload
from kemba.mechanism import load_robot
from kemba.model import Model, build_model, load_spec
from kemba.model.changes import changed_effects
from kemba.model.spec import own_robot

PLAIN = "planning"


def counterpart(
    model: str,
    payload: float = 0.0,
    supply: float | None = None,
    plant: str = "plant",
    own_effects: bool = True,
    changes: Mapping[str, Mapping[str, Any]] | None = None,
) -> Model:
    """The model YAML `plant` on the robot of the planning model `model`, with its own effects.

    A plant whose own file names a robot keeps that one. Own effects are those of `model` that the
    shipped planning model lacks, except those of the air and those that the plant itself
    describes; `own_effects` False leaves them all out. `payload` [kg],
    `supply` [Pa] and `changes` of effects are the task's. Raises KembaError as `load_model` does.
    """
    spec, own = load_spec(plant), load_spec(model)
    plain: list[Effect] = [*load_spec(PLAIN).effects]
    named = {e.name: e for e in (*own.effects, *changed_effects(model, changes or {}))}
    mine: list[Effect] = [e for e in named.values() if e not in plain]
    theirs: list[Effect] = [e for e in spec.effects if e not in plain]
    theirs += [e for make in CHAMBERS.values() for e in make()]
    fixed = {e.name for e in theirs}
    extra = [e for e in mine if own_effects and e.moves and e.name not in fixed]
    extra += [Payload(m=payload)] if payload else []
    spec = spec.model_copy(update={"robot": own_robot(plant) or own.robot})
    return build_model(spec, extra, supply or own.supply)


def another_robot(model: str, plant: str) -> str | None:
    """The name of the robot that the file of `plant` names, where it is not that of `model`."""
    named = own_robot(plant)
    return load_robot(named).name if named and named != load_spec(model).robot else None
