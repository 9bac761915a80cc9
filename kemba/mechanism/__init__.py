"""The robot as a mechanism: link table, pin.Model, symbolic dynamics, loop closure, ports."""

from kemba.mechanism.links import Leg, Link, Piston, Robot, load_robot
from kemba.mechanism.planar import Mechanism, Port
from kemba.mechanism.rig import rig_mechanism
from kemba.mechanism.robot import robot_mechanism

__all__ = [
    "Leg",
    "Link",
    "Mechanism",
    "Piston",
    "Port",
    "Robot",
    "load_robot",
    "rig_mechanism",
    "robot_mechanism",
]
