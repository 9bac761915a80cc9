"""Valves that switch later than their nominal dead time."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from kemba.effects.base import Effect
from kemba.quantity import Param

EARLIEST = -0.006  # s; nothing switches before its command, whose nominal dead time this is
Delay = Annotated[float, Param("s", 0.002, lower=EARLIEST, doc="beyond the nominal dead time")]


class ValveDelay(Effect):
    """Both switchings come later (or, with dt < 0, earlier) than the nominal dead time."""

    kind: Literal["valve_delay"] = "valve_delay"
    dt: Delay = 0.0

    family: ClassVar[str] = "air"
    equation: ClassVar[str] = "u(t) = command(t - dead_time - dt)"
    source: ClassVar[str] = "paper Fig. 3: dead time 6 ms on the authors' valves; others differ"
    ports: ClassVar[tuple[str, ...]] = ("piston",)
    off: ClassVar[dict[str, float]] = {"dt": 0.0}

    def timing(self) -> dict[str, float]:
        return {"on": self.dt, "off": self.dt}


class ValveCloseDelay(Effect):
    """Switching off comes later than switching on: the armature is held for a moment."""

    kind: Literal["valve_close_delay"] = "valve_close_delay"
    dt: Delay = 0.0

    family: ClassVar[str] = "air"
    equation: ClassVar[str] = "switching off by dt later than switching on"
    source: ClassVar[str] = "solenoid valves: opening and closing times differ"
    ports: ClassVar[tuple[str, ...]] = ("piston",)
    off: ClassVar[dict[str, float]] = {"dt": 0.0}

    def timing(self) -> dict[str, float]:
        return {"off": self.dt}
