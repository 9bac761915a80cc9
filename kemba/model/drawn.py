"""Models drawn from the joint covariance of what was learnt."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from kemba.effects import Effect
from kemba.model.model import Model
from kemba.model.spec import read_covariance

DRAWN = 40  # models: the spread is then known to a tenth


def drawn_models(model: Model, name: str | Path, count: int = DRAWN, seed: int = 0) -> list[Model]:
    """So many models drawn from the covariance of the model YAML `name` about `model`.

    Parameters stay within their bounds. Raises KembaError where the covariance is missing or none.
    """
    names, covariance = read_covariance(name)
    known = {e.name: e for e in model.effects}
    middle = np.array([_value(known, n) for n in names])
    size, axes = np.linalg.eigh(covariance)
    root = axes * np.sqrt(np.maximum(size, 0.0))
    steps = np.random.default_rng(seed).standard_normal((count, len(names))) @ root.T
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
