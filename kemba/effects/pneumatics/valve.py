"""Binary on/off valves with their dead time (paper, eq. 8 and section III-A)."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from kemba.effects.base import Effect
from kemba.quantity import Param, Quantity


class Valve(Effect):
    """On/off valves of both chambers, u (1 - u) = 0, acting `dead_time` after the command."""

    kind: Literal["valve"] = "valve"
    dead_time: Annotated[float, Param("s", 0.001, lower=0.0, doc="command to first reaction")] = (
        0.006
    )

    family: ClassVar[str] = "air"
    equation: ClassVar[str] = "u (1 - u) = 0, u(t) = command(t - dead_time)"
    source: ClassVar[str] = "paper eq. 8, Fig. 3 (6 ms)"

    def inputs(self) -> dict[str, Quantity]:
        return {
            "u_e": Quantity("valve/extend", "1", 0, 1, binary=True, doc="extend chamber's valve"),
            "u_r": Quantity("valve/retract", "1", 0, 1, binary=True, doc="retract chamber's valve"),
        }

    def timing(self) -> dict[str, float]:
        return {"on": self.dead_time, "off": self.dead_time}
