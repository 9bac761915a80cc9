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
from kemba.model.spec import ModelSpec, own_robot
from kemba.scene import FLAT, Scene

PLAIN = "planning"


def counterpart(
    model: str,
    payload: float = 0.0,
    supply: float | None = None,
    plant: str = "plant",
    own_effects: bool = True,
    changes: Mapping[str, Mapping[str, Any]] | None = None,
    scene: Scene = FLAT,
) -> Model:
    """The model YAML `plant` on the robot of the planning model `model`, with its own effects.

    The plant gives the air and what its file describes beyond the shipped planning model; all else
    is the model's, so that one without a boom has a plant without one. An effect that was learnt
    from logs replaces the plant's own. A plant whose file names a robot keeps that one.
    `own_effects` False: the plant as its file has it. `payload` [kg], `supply` [Pa] and `changes`
    of effects and `scene` are the task's. Raises KembaError as `load_model` does.
    """
    spec, own = load_spec(plant), load_spec(model)
    extra: list[Effect] = [Payload(m=payload)] if payload else []
    if own_effects:
        named = {e.name: e for e in (*own.effects, *changed_effects(model, changes or {}))}
        theirs = _described(spec)
        air = {e.name for make in CHAMBERS.values() for e in make()}
        fixed = {e.name for e in theirs if e.name not in _learnt(own)} | air
        mine = [e for e in named.values() if e.moves and e.name not in fixed]
        kept = {e.name: e for e in (*theirs, *mine)}
        spec = spec.model_copy(update={"effects": tuple(kept.values())})
    spec = spec.model_copy(update={"robot": own_robot(plant) or own.robot})
    return build_model(spec, extra, supply or own.supply, scene=scene)


def lacking(model: str, plant: str) -> list[str]:
    """The effects of the plant's file that its counterpart for a model leaves out, because the
    model does not have them either."""
    known = {e.name for e in (*load_spec(model).effects, *_described(load_spec(plant)))}
    return [e.name for e in load_spec(plant).effects if e.name not in known]


def another_robot(model: str, plant: str) -> str | None:
    """The name of the robot that the file of `plant` names, where it is not that of `model`."""
    named = own_robot(plant)
    return load_robot(named).name if named and named != load_spec(model).robot else None


def _described(plant: ModelSpec) -> list[Effect]:
    """What a plant has beyond the shipped planning model."""
    plain: list[Effect] = [*load_spec(PLAIN).effects]
    return [e for e in plant.effects if e not in plain]


def _learnt(model: ModelSpec) -> set[str]:
    """The effects of a model that were learnt from logs."""
    return {e.name for e in model.effects if e.support is not None}
