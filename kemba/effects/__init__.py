"""The catalogue of physics: one definition per effect for optimiser, simulator, identification."""

from typing import Annotated

from kemba.effects.base import At, Contribution, Deviation, Effect, Pair, PortAt, Signal
from kemba.effects.catalogue import BY_KIND, EFFECTS, load_effects
from kemba.effects.registry import Registered

# an effect of any kind that is known when it is read
AnyEffect = Annotated[Effect, Registered(BY_KIND)]

__all__ = [
    "BY_KIND",
    "EFFECTS",
    "AnyEffect",
    "At",
    "Contribution",
    "Deviation",
    "Effect",
    "Pair",
    "PortAt",
    "Signal",
    "load_effects",
]
