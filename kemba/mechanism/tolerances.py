"""Links are never exactly as drawn: which figures may be off, how much, and the force of that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import casadi as ca
import numpy as np

from kemba.mechanism.links import Robot
from kemba.mechanism.pin_model import build_pin_model
from kemba.mechanism.recursion import Joint, read_joints, rnea


def link_tolerances(robot: Robot) -> dict[str, float]:
    """1 sigma of every figure that may be off, as a share of it, by `leg/link.figure`.

    Links are named by the joint that carries them: `front/hip.mass` is that of the front femur.
    Figures that are known exactly (`tolerances` 0 in the robot's file) are left out.
    """
    shares = robot.tolerances.model_dump()
    return {
        f"{joint.name}.{figure}": share
        for joint in read_joints(build_pin_model(robot))
        if joint.mass
        for figure, share in shares.items()
        if share
    }


def link_forces(
    robot: Robot, tree: ca.SX, rate: ca.SX, acceleration: ca.SX, figures: Sequence[str]
) -> list[ca.SX]:
    """Generalised forces (joints,) per share by which each of `figures` is off.

    `tree`, `rate`, `acceleration` (joints,): motion of the opened tree. The figures are named as
    `link_tolerances` names them. Raises ValueError for others.
    """
    joints = read_joints(build_pin_model(robot))
    names = [joint.name for joint in joints]
    forces = []
    for name in figures:
        link, _, figure = name.rpartition(".")
        whole = _alone(joints, names.index(link))
        point = [replace(joint, inertia=0.0) for joint in whole]
        mass = rnea(point, tree, rate, acceleration, robot.gravity)
        total = rnea(whole, tree, rate, acceleration, robot.gravity)
        forces.append(mass if figure == "mass" else total - mass)
    return forces


def _alone(joints: Sequence[Joint], kept: int) -> list[Joint]:
    """The joints with one link only; all others weigh nothing, and no joint has a rotor."""
    links = [replace(joint, armature=0.0) for joint in joints]
    bare = [replace(joint, mass=0.0, inertia=0.0, com=np.zeros(2)) for joint in links]
    return [*bare[:kept], links[kept], *bare[kept + 1 :]]
