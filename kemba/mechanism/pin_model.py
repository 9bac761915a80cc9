"""Link table -> pin.Model: the opened tree, the single source of geometry and inertia."""

import numpy as np
import pinocchio as pin

from kemba.mechanism.links import Link, Robot

COUNTER_CLOCKWISE = np.array([0.0, -1.0, 0.0])  # x right, z up: y points into the plane
DOWN = np.array([0.0, 0.0, -1.0])


def build_pin_model(robot: Robot) -> pin.Model:
    """The tree with every loop opened at the rod's pin: x, z, pitch, then per leg
    hip, knee, cylinder, rod (11 joints for two legs)."""
    model = pin.Model()
    model.name = robot.name
    model.gravity.linear = robot.gravity * DOWN
    body = model.addJoint(0, pin.JointModelPX(), pin.SE3.Identity(), "body/x")
    body = model.addJoint(body, pin.JointModelPZ(), pin.SE3.Identity(), "body/z")
    body = _revolute(model, body, "body/pitch", np.zeros(3))
    _attach(model, body, robot.body, 0.0)
    for name, place in robot.legs.items():
        _add_leg(model, body, robot, name, np.array([place.hip, 0.0, 0.0]), place.fold)
    return model


def _add_leg(
    model: pin.Model, body: int, robot: Robot, name: str, hip: np.ndarray, fold: int
) -> None:
    leg = robot.leg
    femur = _revolute(model, body, f"{name}/hip", hip)
    tibia = _revolute(model, femur, f"{name}/knee", leg.femur.length * DOWN)
    mount = np.array([fold * leg.piston.mount, 0.0, 0.0])
    cylinder = _revolute(model, femur, f"{name}/cylinder", mount)
    rod = model.addJoint(
        cylinder,
        pin.JointModelPrismaticUnaligned(DOWN),
        pin.SE3(np.eye(3), leg.piston.retracted * DOWN),
        f"{name}/rod",
    )
    _attach(model, femur, leg.femur, leg.femur.com)
    _attach(model, tibia, leg.tibia, leg.tibia.com)
    _attach(model, cylinder, leg.cylinder, leg.cylinder.com)
    _attach(model, rod, leg.rod, -leg.rod.com)
    armature = np.array(model.armature)
    armature[model.joints[femur].idx_v] = leg.rotor_inertia
    model.armature = armature


def _revolute(model: pin.Model, parent: int, name: str, at: np.ndarray) -> int:
    joint = pin.JointModelRevoluteUnaligned(COUNTER_CLOCKWISE)
    return int(model.addJoint(parent, joint, pin.SE3(np.eye(3), at), name))


def _attach(model: pin.Model, joint: int, link: Link, down: float) -> None:
    # only the inertia about y matters in the plane; the others keep pinocchio's checks happy
    inertia = pin.Inertia(link.mass, down * DOWN, link.inertia * np.eye(3))
    model.appendBodyToJoint(joint, inertia, pin.SE3.Identity())
