"""Equations made once: for a model, and for models that differ from it in numbers only."""

from __future__ import annotations

import weakref
from dataclasses import dataclass
from typing import Any

from kemba.mechanism import Mechanism
from kemba.model import Model
from kemba.plant.stepping.equations import Equations


@dataclass
class Family:
    """Models of one mechanism with the same effects: `numbers` are those of the first of them."""

    structure: tuple[Any, ...]
    numbers: dict[str, float]
    equations: Equations


_OF_MODEL: weakref.WeakKeyDictionary[Model, Equations] = weakref.WeakKeyDictionary()
_FAMILIES: dict[int, list[Family]] = {}  # by the identity of the mechanism


def equations_of(model: Model) -> Equations:
    """The equations of a model. Models that differ in numbers only share them: what differs is a
    parameter of the machine code then, see `Equations.values`."""
    if model not in _OF_MODEL:
        _OF_MODEL[model] = _find(model)
    return _OF_MODEL[model]


def _find(model: Model) -> Equations:
    structure = _structure(model)
    numbers = {name: value for name, (_, value) in model.parameters.items()}
    families = _families(model.mechanism)
    for family in families:
        if family.structure == structure:
            new = {name for name, value in numbers.items() if value != family.numbers[name]}
            if not new <= set(family.equations.free):
                family.equations = Equations(model, sorted({*family.equations.free, *new}))
            return family.equations
    families.append(Family(structure, numbers, Equations(model)))
    return families[-1].equations


def _families(mechanism: Mechanism) -> list[Family]:
    key = id(mechanism)
    if key not in _FAMILIES:
        _FAMILIES[key] = []
        weakref.finalize(mechanism, _FAMILIES.pop, key, None)
    return _FAMILIES[key]


def _structure(model: Model) -> tuple[Any, ...]:
    """What models must have in common to share equations: all but the numbers of the effects."""
    effects = []
    for effect in model.effects:
        numbers = effect.parameters()
        rest = {name: value for name, value in effect.model_dump().items() if name not in numbers}
        effects.append((type(effect), repr(rest)))
    return (model.supply, *effects)
