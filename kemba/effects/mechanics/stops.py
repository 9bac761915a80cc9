"""Hard end stops of the piston."""

from __future__ import annotations

from typing import ClassVar, Literal

from kemba.effects.base import At, Contribution, Effect, Pair
from kemba.quantity import Quantity


class EndStop(Effect):
    """The piston stays within its stroke; the stop pushes only when touched."""

    kind: Literal["end_stop"] = "end_stop"

    family: ClassVar[str] = "piston"
    equation: ClassVar[str] = "0 <= x _|_ lam_in >= 0, 0 <= stroke - x _|_ lam_out >= 0"
    source: ClassVar[str] = "paper IV-A.1"
    ports: ClassVar[tuple[str, ...]] = ("piston",)
    on_rod: ClassVar[bool] = False

    def forces(self) -> dict[str, Quantity]:
        top = 20000.0
        return {
            "lam_in": Quantity("piston/stop_in", "N", 0.0, top, 100.0, doc="stop at x = 0"),
            "lam_out": Quantity("piston/stop_out", "N", 0.0, top, 100.0, doc="stop at full stroke"),
        }

    def evaluate(self, at: At) -> Contribution:
        return Contribution(
            effort={"piston": at.lam_in - at.lam_out},
            pairs=(
                Pair("retracted", at.piston.x, at.lam_in),
                Pair("extended", at.stroke - at.piston.x, at.lam_out),
            ),
        )
