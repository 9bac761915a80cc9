"""The robot as a mechanism: link table, pin.Model, symbolic dynamics, loop closure, ports."""

from kemba.mechanism.cylinder import Bore, Cylinder
from kemba.mechanism.links import Leg, Link, Piston, Robot
from kemba.mechanism.own_rigs import (
    CylinderRig,
    DriveRig,
    OwnRig,
    VesselRig,
    own_mechanism,
    rig_mechanism,
)
from kemba.mechanism.planar import Mechanism, Port
from kemba.mechanism.robot import reshaped, robot_mechanism
from kemba.mechanism.robot_file import load_cylinder, load_robot

__all__ = [
    "Bore",
    "Cylinder",
    "CylinderRig",
    "DriveRig",
    "Leg",
    "Link",
    "Mechanism",
    "OwnRig",
    "Piston",
    "Port",
    "Robot",
    "VesselRig",
    "load_cylinder",
    "load_robot",
    "own_mechanism",
    "reshaped",
    "rig_mechanism",
    "robot_mechanism",
]
