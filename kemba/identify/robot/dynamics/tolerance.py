"""Links are never exactly as drawn: forces per share by which their masses are off."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np

from kemba.mechanism.pin_model import build_pin_model
from kemba.mechanism.recursion import Joint, read_joints, rnea
from kemba.mechanism.robot import tree_angles
from kemba.model.model import Model
from kemba.settings import Settings, setting


class ToleranceShareSettings(Settings):
    """How well the links of a robot are known."""

    share: float = setting(
        0.02,
        "1",
        "prior sigma of a link's mass and inertia, as a share of it",
        "convention: nominal figures are off by 1 to 3 %",
        decides=True,
    )


def mass_regressors(model: Model) -> tuple[tuple[str, ...], ca.Function]:
    """Names and (q, v, a) -> (n, k): forces per share by which a link's mass or inertia is off."""
    m = model.mechanism
    robot = m.need_robot()
    tree = tree_angles(robot, m.q)
    rate = ca.jtimes(tree, m.q, m.v)
    acc = ca.jtimes(rate, m.q, m.v) + ca.jtimes(tree, m.q, m.a)
    joints = read_joints(build_pin_model(robot))
    names, columns = [], []
    for i, joint in enumerate(joints):
        if not joint.mass:
            continue
        light = [_bare(j) if k != i else replace(j, armature=0.0) for k, j in enumerate(joints)]
        point = [replace(j, inertia=0.0) for j in light]
        whole = rnea(light, tree, rate, acc, robot.gravity)
        mass = rnea(point, tree, rate, acc, robot.gravity)
        for what, force in (("mass", mass), ("inertia", whole - mass)):
            names.append(f"tolerance.{joint.name}.{what}")
            columns.append(ca.jtimes(tree, m.q, force, True))
    return tuple(names), ca.Function("regress", [m.q, m.v, m.a], [ca.horzcat(*columns)])


def _bare(joint: Joint) -> Joint:
    return replace(joint, mass=0.0, inertia=0.0, armature=0.0, com=np.zeros(2))
