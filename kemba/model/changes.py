"""Models changed: numbers by name, or drawn at random."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from kemba.config import Document, parse
from kemba.effects import Effect
from kemba.effects.catalogue import CHAMBERS
from kemba.errors import ConfigErrors, KembaError, listed_errors, suggest
from kemba.model.model import Model
from kemba.model.spec import ModelSpec, load_spec, read_covariance

Changes = Mapping[str, Mapping[str, Any]]


def changed_effects(
    model: str | Path, changes: Changes, document: Document | None = None
) -> list[Effect]:
    """The effects of the model YAML `model` that `changes` names, with their parameters changed.

    A key of `changes` is the name of an effect (`contact`, `valve_delay:front`) or its place in
    the model's list, from 0, with those of its bases first. `document`: the task, whose places
    are named in messages. Raises ConfigErrors with every effect that there is not and every wrong
    parameter.
    """
    if not changes:
        return []
    source = document or Document({"effects": dict(changes)})
    listed = _listed(load_spec(model))
    found: dict[str, Effect] = {}
    errors: list[KembaError] = []
    for key, values in changes.items():
        try:
            effect = _named(listed, key, str(model), source)
            effect = found.get(effect.name, effect)
            found[effect.name] = parse(_part(source, key, effect, values), type(effect))
        except KembaError as error:
            errors += listed_errors(error)
    if errors:
        raise ConfigErrors(errors)
    return list(found.values())


def _listed(spec: ModelSpec) -> tuple[Effect, ...]:
    """The effects of a model: those on its list, then those of its chambers."""
    names = {effect.name for effect in spec.effects}
    chambers = CHAMBERS[spec.chambers or "first_order"]()
    return (*spec.effects, *(effect for effect in chambers if effect.name not in names))


def _named(listed: tuple[Effect, ...], key: str, model: str, source: Document) -> Effect:
    """The effect of a list by its name or place."""
    if key.isdigit() and int(key) < len(listed):
        return listed[int(key)]
    found = [effect for effect in listed if effect.name == key]
    if found:
        return found[0]
    names = [effect.name for effect in listed]
    what = f"effects: the model '{model}' has no effect '{key}'"
    expected = f"0 to {len(names) - 1}, or a name on its list, was expected"
    raise source.error(("effects", key), what, expected, suggest(key, names))


def _part(source: Document, key: str, effect: Effect, values: Mapping[str, Any]) -> Document:
    """One changed effect as a document of its own; its parts keep their places in the task."""
    at = ("effects", key)
    kept = {p[2:]: mark for p, mark in source.marks.items() if p[:2] == at}
    told = {p[2:]: text for p, text in source.overrides.items() if p[:2] == at}
    data = {**effect.model_dump(exclude_unset=True), "kind": effect.kind, **values}
    return Document(data, source.source, source.lines, kept, told)


DRAWN = 40  # models: the spread is then known to a tenth


def drawn_models(model: Model, name: str | Path, count: int = DRAWN) -> list[Model]:
    """So many models drawn from the covariance of the model YAML `name` about `model`.

    Parameters stay within their bounds. Raises KembaError where the covariance is missing or none.
    """
    names, covariance = read_covariance(name)
    known = {e.name: e for e in model.effects}
    middle = np.array([_value(known, n) for n in names])
    size, axes = np.linalg.eigh(covariance)
    root = axes * np.sqrt(np.maximum(size, 0.0))
    steps = np.random.default_rng(0).standard_normal((count, len(names))) @ root.T
    return [_with(model, dict(zip(names, middle + step, strict=True))) for step in steps]


def _value(known: Mapping[str, Effect], name: str) -> float:
    effect, _, parameter = name.rpartition(".")
    return float(known[effect].value(parameter)) if effect in known else 0.0


def _with(model: Model, values: Mapping[str, float]) -> Model:
    """The model with parameters changed, each within its bounds."""
    effects = []
    for effect in model.effects:
        declared = effect.parameters()
        own = {}
        for name, value in values.items():
            owner, _, parameter = name.rpartition(".")
            if owner == effect.name:
                bounds = declared.get(parameter)
                own[parameter] = (
                    float(np.clip(value, bounds.lower, bounds.upper)) if bounds else value
                )
        effects.append(effect.bind(own) if own else effect)
    return Model(model.mechanism, effects, model.supply, model.name)
