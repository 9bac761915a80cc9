"""Equations made once: for a model, and for models that differ from it in numbers only."""

from __future__ import annotations

import weakref
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from kemba.cache import Recent
from kemba.mechanism import Mechanism
from kemba.model import SUPPLY, Model
from kemba.plant.kernel.settings import StepLength
from kemba.plant.stepping.equations import Equations, numbers_of
from kemba.settings import Settings, setting


class Kept(Settings):
    """What a process keeps for the next plan."""

    models: int = setting(
        8, "1", "models whose machine code is kept",
        "convention: twice those of a plan: its model and its plant, each with fitted air",
    )  # fmt: skip


@dataclass
class Family:
    """Models of one mechanism with the same effects: `numbers` are those of the first of them."""

    structure: tuple[Any, ...]
    numbers: dict[str, float]
    equations: Equations


_OF_MODEL: weakref.WeakKeyDictionary[Model, Equations] = weakref.WeakKeyDictionary()
_FAMILIES: dict[int, list[Family]] = {}  # by the identity of the mechanism
_PLAIN: Recent[tuple[Any, ...], Equations] = Recent()  # by what a model consists of


def equations_of(model: Model) -> Equations:
    """The equations of a model. Models that differ in numbers only share them: what differs is a
    parameter of the machine code then, see `Equations.values`."""
    share_equations([model])
    return _OF_MODEL[model]


def share_equations(models: Iterable[Model]) -> None:
    """Make the equations of models that are simulated together: all that differs among those of a
    family is free at once, so that its machine code is made once."""
    found = [(model, _family(model)) for model in models if model not in _OF_MODEL]
    for model, family in found:
        _OF_MODEL[model] = family.equations


def _family(model: Model) -> Family:
    """The family of a model, in whose equations all is free in which this one differs."""
    structure, numbers = _structure(model), numbers_of(model)
    families = _families(model.mechanism)
    for family in families:
        if family.structure == structure:
            known = {*family.equations.free, *family.equations.scaled}
            new = {name for name, value in numbers.items() if value != family.numbers[name]}
            if not new <= known:
                family.equations = _with_free(model, known | new)
            return family
    families.append(Family(structure, numbers, _plain(model, structure, numbers)))
    return families[-1]


def _plain(model: Model, structure: tuple[Any, ...], numbers: dict[str, float]) -> Equations:
    """Equations without free numbers. They are the same for equal models, whatever was simulated
    before, so that a process that plans again and again makes them once."""
    mechanism = model.mechanism
    if mechanism.drawn is None:
        return Equations(model)
    lengths = tuple(sorted(mechanism.offsets.items()))
    robot = mechanism.drawn.model_dump_json(), lengths, repr(mechanism.scene.json())
    key = (robot, structure, tuple(numbers.items()), StepLength.current())
    return _PLAIN.get(key, lambda: Equations(model), Kept.current().models)


def _with_free(model: Model, names: set[str]) -> Equations:
    """Equations in which `names` are free; of an effect one of whose tables is among them, all
    tables, since a fit changes one after the other."""
    entries = numbers_of(model).keys() - model.parameters.keys() - {SUPPLY}
    effects = {name.rpartition(".")[0] for name in names & entries}
    scaled = sorted(name for name in entries if name.rpartition(".")[0] in effects)
    return Equations(model, sorted(names - entries), scaled)


def _families(mechanism: Mechanism) -> list[Family]:
    key = id(mechanism)
    if key not in _FAMILIES:
        _FAMILIES[key] = []
        weakref.finalize(mechanism, _FAMILIES.pop, key, None)
    return _FAMILIES[key]


def _structure(model: Model) -> tuple[Any, ...]:
    """What models must have in common to share equations: all but the numbers of the effects, and
    which entries of their tables are zero, since no factor changes these."""
    effects = []
    for effect in model.effects:
        tables = effect.tables()
        apart = {*effect.parameters(), *tables}
        rest = {name: value for name, value in effect.model_dump().items() if name not in apart}
        zeros = [[entry == 0.0 for entry in table] for table in tables.values()]
        effects.append((type(effect), repr((rest, zeros))))
    return tuple(effects)
