"""The robot as a mechanism: link table, pin.Model, symbolic dynamics, loop closure, ports."""

from kemba.mechanism.cylinder import Cylinder
from kemba.mechanism.links import Leg, Link, Piston, Robot
from kemba.mechanism.planar import Mechanism, Port
from kemba.mechanism.rig import rig_mechanism
from kemba.mechanism.robot import reshaped, robot_mechanism
from kemba.mechanism.robot_file import load_cylinder, load_robot

__all__ = [
    "Cylinder",
    "Leg",
    "Link",
    "Mechanism",
    "Piston",
    "Port",
    "Robot",
    "load_cylinder",
    "load_robot",
    "reshaped",
    "rig_mechanism",
    "robot_mechanism",
]
