"""Binary on/off valves (paper, eq. 8 and section III-A), their dead time, and later switching."""

from typing import Annotated

from kemba.effects.base import AirEffect, Effect
from kemba.quantity import Param, Quantity


class Valve(Effect):
    """On/off valves of both chambers, u (1 - u) = 0, acting `dead_time` after the command."""

    dead_time: Annotated[float, Param("s", 0.001, lower=0.0, doc="command to first reaction")] = (
        0.006
    )

    family = "air"
    equation = "u (1 - u) = 0, u(t) = command(t - dead_time)"
    source = "paper eq. 8, Fig. 3 (6 ms)"

    def inputs(self) -> dict[str, Quantity]:
        return {
            "u_e": Quantity("valve/extend", "1", 0, 1, binary=True, doc="extend chamber's valve"),
            "u_r": Quantity("valve/retract", "1", 0, 1, binary=True, doc="retract chamber's valve"),
        }

    def timing(self) -> dict[str, float]:
        return {"on": self.dead_time, "off": self.dead_time}


EARLIEST = -0.006  # s; nothing switches before its command, whose nominal dead time this is
Delay = Annotated[float, Param("s", 0.002, lower=EARLIEST, doc="beyond the nominal dead time")]


class ValveDelay(AirEffect):
    """Both switchings come later (or, with dt < 0, earlier) than the nominal dead time."""

    dt: Delay = 0.0

    equation = "u(t) = command(t - dead_time - dt)"
    source = "paper Fig. 3: dead time 6 ms on the authors' valves; others differ"

    def timing(self) -> dict[str, float]:
        return {"on": self.dt, "off": self.dt}


class ValveCloseDelay(AirEffect):
    """Switching off comes later than switching on: the armature is held for a moment."""

    dt: Delay = 0.0

    equation = "switching off by dt later than switching on"
    source = "solenoid valves: opening and closing times differ"

    def timing(self) -> dict[str, float]:
        return {"off": self.dt}
