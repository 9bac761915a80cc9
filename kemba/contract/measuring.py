"""Promises about what identification takes from an effect: sensor faults, nominal tolerances."""

from __future__ import annotations

import numpy as np

from kemba.contract.cases import Broken, Placed, points, slopes
from kemba.contract.settings import ContractSettings
from kemba.effects.base import Effect
from kemba.effects.sensors import SensorEffect
from kemba.effects.series import Series


def measures(effect: type[Effect]) -> bool:
    """Whether the effect is a fault of a sensor."""
    return issubclass(effect, SensorEffect)


def moves(effect: type[Effect]) -> bool:
    """Whether the effect enters the equations of motion."""
    return effect.moves


def sensor_fault_can_be_undone(placed: Placed) -> None:
    """A sensor fault changes what is measured, and `undone` is the inverse of `measured`.

    Raises Broken where it is not so.
    """
    fault = placed.on
    if not isinstance(fault, SensorEffect):
        return
    time = np.linspace(0.0, 1.0, 2001)
    true = Series(time, np.sin(9 * time), (9 * np.cos(9 * time),))
    shown = fault.measured(true)
    if np.abs(shown.value - true.value).max() <= ContractSettings.current().seen:
        raise Broken("it changes nothing that is measured")
    if np.abs(fault.undone(shown).value - true.value).max() > ContractSettings.current().undone:
        raise Broken("`undone` does not give back the input of `measured`")


def nominal_figures_matter(placed: Placed) -> None:
    """What a fit leaves free within a tolerance is a figure of the effect and changes the model.

    Raises Broken where it is not so.
    """
    effect, settings = placed.resolved, ContractSettings.current()
    for name, tolerance in effect.nominal.items():
        if name not in type(effect).model_fields:
            raise Broken(f"`nominal` names '{name}', which is no field")
        if not getattr(effect, name):
            raise Broken(f"{name} has a tolerance, but no value")
        if not tolerance.source:
            raise Broken(f"{name}: its tolerance has no source")
    tolerances = effect.tolerances()
    for figure, share in tolerances.items():
        if not 0.0 < share <= settings.widest:
            expected = f"0 to {settings.widest:g} expected"
            raise Broken(f"{figure}: its tolerance is {share:g} of it; {expected}")
    missing = set(effect.nominal) - {name.partition("[")[0] for name in tolerances}
    if missing:
        raise Broken(f"`tolerances` leaves '{sorted(missing)[0]}' out")
    if not tolerances:
        return
    scaled = slopes(placed.model, [], [f"{effect.name}.{figure}" for figure in tolerances])
    ones = [1.0] * len(tolerances)
    found = [np.abs(scaled(**x, p=ones)["dp"].full()) for x in points(placed.model, 12)]
    largest = np.max(found, axis=(0, 1))
    for figure, slope in zip(tolerances, largest, strict=True):
        if slope <= settings.nothing:
            raise Broken(f"{figure} has a tolerance, but it changes nothing")
