"""The catalogue of physics: one definition per effect for optimiser, simulator, identification."""

from typing import Annotated, Union

from pydantic import Field

from kemba.effects.base import At, Contribution, Effect, Pair, PortAt, Signal
from kemba.effects.catalogue import BY_KIND, EFFECTS

AnyEffect = Annotated[
    Union[EFFECTS],  # type: ignore[valid-type]  # noqa: UP007
    Field(discriminator="kind"),
]

__all__ = [
    "BY_KIND",
    "EFFECTS",
    "AnyEffect",
    "At",
    "Contribution",
    "Effect",
    "Pair",
    "PortAt",
    "Signal",
]
