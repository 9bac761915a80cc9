"""What the effects of an axis have in common."""

from __future__ import annotations

from typing import ClassVar

from kemba.effects.base import Effect


class AxisEffect(Effect):
    """An effect at the axis of a drive: looked for on the user's own rigs only."""

    family: ClassVar[str] = "drive"
    ports: ClassVar[tuple[str, ...]] = ("axis",)
    own_rigs: ClassVar[bool] = True
