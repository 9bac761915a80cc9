"""Nominal figures that every fit leaves free: what a machine has a little different from its model.

Which they are and by how much is declared by the effect or the mechanism whose figures they are.
"""

from __future__ import annotations

from collections.abc import Iterable

from kemba.effects.base import Effect
from kemba.model.model import Model

LINK = "tolerance."  # how names of a link's figures begin


def nominal_figures(model: Model, except_for: Iterable[str] = ()) -> dict[str, tuple[float, float]]:
    """Factor 1 and its 1 sigma by figure, named as `Model.build(scaled=...)` takes them.

    `except_for`: parameters that are free anyway; the figures of their effects are left out.
    """
    free = {name.rsplit(".", 1)[0] for name in except_for}
    return {
        f"{effect.name}.{figure}": (1.0, share)
        for effect in model.effects
        if effect.name not in free
        for figure, share in effect.tolerances().items()
    }


def link_figures(model: Model) -> dict[str, tuple[float, float]]:
    """Share 0 by which a link's figure is off, and its 1 sigma, by name; {} for a rig."""
    found = model.mechanism.tolerances
    return {f"{LINK}{name}": (0.0, share) for name, share in found.items()}


def leg_by_leg(model: Model) -> Model:
    """The same model with every effect that has nominal figures of its own once per leg: the parts
    of one leg differ from those of another."""
    effects: list[Effect] = []
    for effect in model.effects:
        if effect.nominal and effect.place == "leg" and effect.leg is None:
            effects += [effect.bind({"on": leg}) for leg in model.mechanism.legs]
        else:
            effects.append(effect)
    return Model(model.mechanism, effects, model.supply, model.name)
