"""The legged robot: tree of the pin.Model, knee loops closed, seen through ports."""

from copy import copy
from dataclasses import replace
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin

from kemba.errors import KembaError
from kemba.mechanism import knee
from kemba.mechanism.links import SPLIT, Link, Offsets, Robot, altered, nominal_length
from kemba.mechanism.planar import Mechanism, Port
from kemba.mechanism.recursion import (
    FrameMotion,
    Joint,
    Vector,
    forward,
    link_forces,
    link_tolerances,
    read_joints,
    rnea,
)
from kemba.quantity import Quantity

COUNTER_CLOCKWISE = np.array([0.0, -1.0, 0.0])  # x right, z up: y points into the plane
DOWN = np.array([0.0, 0.0, -1.0])


def build_pin_model(robot: Robot) -> pin.Model:
    """The link table as a tree, the single source of geometry and inertia, with every loop opened
    at the rod's pin: x, z, pitch, then per leg hip, knee, cylinder, rod (11 joints for two legs).
    """
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


HIP_RANGE = 1.4  # rad; beyond it the knee would rise above the body


def robot_mechanism(
    drawn: Robot, offsets: Offsets | None = None, symbols: Offsets | None = None
) -> Mechanism:
    """The mechanism of a link table: q = (x, z, pitch, hips, knees), n = 3 + 2 legs.

    `offsets` [m or kg]: lengths, and mass between body and legs, that differ from those of the
    table `drawn`. `symbols`: the same
    offsets in expressions, where these depend on parameters. Raises KembaError where the knee
    cannot close with these lengths.
    """
    if offsets or symbols:
        return _mechanism(drawn, dict(offsets or {}), symbols or {})
    # an object of its own: models of one mechanism share machine code in the plant, which must
    # not depend on what else was loaded before
    return copy(_nominal(drawn.model_dump_json()))


@lru_cache(maxsize=8)
def _nominal(table: str) -> Mechanism:
    return _mechanism(Robot.model_validate_json(table), {}, {})


def _mechanism(drawn: Robot, offsets: Offsets, symbols: Offsets) -> Mechanism:
    robot = _closed(altered(drawn, offsets), offsets)
    coordinates, velocities = _coordinates(robot)
    n = len(coordinates)
    q, v, a = ca.SX.sym("q", n), ca.SX.sym("v", n), ca.SX.sym("a", n)
    shape = altered(drawn, {**offsets, **symbols})
    drawn_joints = read_joints(build_pin_model(robot))
    joints = _placed(drawn_joints, shape, weighed=SPLIT in symbols)
    tree = tree_angles(shape, q)
    tree_v = ca.jtimes(tree, q, v)
    tree_a = ca.jtimes(tree_v, q, v) + ca.jtimes(tree, q, a)
    tree_tau = rnea(joints, tree, tree_v, tree_a, robot.gravity)
    motions = dict(
        zip((j.name for j in joints), forward(joints, tree, tree_v, tree_a, 0.0), strict=True)
    )
    mass, points = sum(j.mass for j in drawn_joints), _points(shape, motions)
    return Mechanism(
        name=robot.name,
        q=q,
        v=v,
        a=a,
        coordinates=coordinates,
        velocities=velocities,
        inverse_dynamics=ca.jtimes(tree, q, tree_tau, True),
        ports=_ports(shape, q, points),
        legs=tuple(robot.legs),
        weight=float(mass * robot.gravity),
        mass=float(mass),
        body_mass=robot.body.mass,
        gravity=robot.gravity,
        robot=robot,
        drawn=drawn,
        offsets=offsets,
        cylinder=robot.cylinder,
        mirror=_mirror(robot),
        standing=standing_pose(robot),
        points={name: ca.vertcat(*at) for name, at in points.items()},
        tolerances=link_tolerances(drawn_joints, robot.tolerances.model_dump()),
    )


def link_regressors(mechanism: Mechanism) -> ca.Function:
    """(q, v, a), each (n,), -> (n, k): generalised force per share by which a link is off.

    The k columns are the figures of `mechanism.tolerances`, in their order. Raises KembaError for a
    mechanism that is no robot.
    """
    m, robot = mechanism, mechanism.need_robot()
    tree = tree_angles(robot, m.q)
    rate = ca.jtimes(tree, m.q, m.v)
    acc = ca.jtimes(rate, m.q, m.v) + ca.jtimes(tree, m.q, m.a)
    joints = read_joints(build_pin_model(robot))
    forces = link_forces(joints, list(m.tolerances), (tree, rate, acc), robot.gravity)
    columns = ca.jtimes(tree, m.q, forces, True)
    return ca.Function("regress", [m.q, m.v, m.a], [columns])


def reshaped(mechanism: Mechanism, offsets: Offsets, symbols: Offsets | None = None) -> Mechanism:
    """The same mechanism with its lengths `offsets` [m] off the link table; `symbols`: the same in
    expressions. A rig has none of these lengths and stays as it is."""
    if mechanism.drawn is None or (not symbols and dict(offsets) == dict(mechanism.offsets)):
        return mechanism
    return robot_mechanism(mechanism.drawn, offsets, symbols).on(
        mechanism.scene, mechanism.origin[0]
    )


def _placed(joints: list[Joint], robot: Robot, weighed: bool) -> list[Joint]:
    """The joints at the places that the lengths of `robot` give them, which may be symbols;
    `weighed`: with its masses, too."""
    leg = robot.leg
    changes: dict[str, dict[str, Any]] = {"body/pitch": _weight(robot.body, weighed)}
    for name, place in robot.legs.items():
        knee = {"offset": (0.0, -leg.femur.length)}
        mount = {"offset": (place.fold * leg.piston.mount, 0.0)}
        changes[f"{name}/hip"] = _weight(leg.femur, weighed)
        changes[f"{name}/knee"] = {**knee, **_weight(leg.tibia, weighed)}
        changes[f"{name}/cylinder"] = {**mount, **_weight(leg.cylinder, weighed)}
        changes[f"{name}/rod"] = _weight(leg.rod, weighed)
    return [replace(j, **changes.get(j.name, {})) for j in joints]


def _weight(link: Link, weighed: bool) -> dict[str, Any]:
    return {"mass": link.mass, "inertia": link.inertia} if weighed else {}


def _closed(robot: Robot, offsets: Offsets) -> Robot:
    """The robot, if its masses and lengths are positive and its knee closes at both ends of the
    stroke."""
    if min(robot.body.mass, robot.leg.femur.mass) <= 0.0:
        what = f"m = {offsets[SPLIT]:g} kg leaves the body or the legs no mass"
        raise KembaError("effects.mass_split", what, "less mass than either has was expected")
    lengths = {part: d for part, d in offsets.items() if part != SPLIT}
    for part, d in lengths.items():
        if nominal_length(robot.leg, part) <= 0.0:
            what = f"d = {1e3 * d:g} mm leaves nothing of this length"
            expected = "a small difference between machine and drawing was expected"
            raise KembaError(f"effects.geometry:{part}", what, expected)
    for x in (0.0, robot.stroke) if lengths else ():
        try:
            knee.flexion(robot.leg, x)
        except ValueError as error:
            name = "effects.geometry:" + next(iter(lengths))
            expected = "lengths that close the triangle femur, mount, pin at both ends"
            raise KembaError(name, str(error), f"{expected} were expected") from None
    return robot


def standing_pose(robot: Robot, x: float = 0.0) -> dict[str, float]:
    """Coordinates of the level robot with every foot on the ground under its hip and all pistons
    at extension `x` [m]."""
    femur, tibia = robot.leg.femur.length, robot.leg.tibia.length
    bend = knee.flexion(robot.leg, x)
    down, aside = femur + tibia * np.cos(bend), tibia * np.sin(bend)
    pose = {"body/x": 0.0, "body/z": float(np.hypot(down, aside)), "body/pitch": 0.0}
    for leg, place in robot.legs.items():
        pose[f"{leg}/hip/q"] = -place.fold * float(np.arctan2(aside, down))
        pose[f"{leg}/knee/q"] = place.fold * bend
    return pose


def tree_angles(robot: Robot, q: ca.SX) -> ca.SX:
    """Joint positions (3 + 4 legs,) [m or rad] of the opened tree for reduced coordinates `q` (n,).

    They are x, z, pitch, then per leg hip, knee, cylinder, rod. The loop at the knee is always
    closed.
    """
    legs = len(robot.legs)
    tree = [q[0], q[1], q[2]]
    for i, place in enumerate(robot.legs.values()):
        hip, knee_q = q[3 + i], q[3 + legs + i]
        bend = place.fold * knee_q
        angle = place.fold * knee.cylinder_angle(robot.leg, bend)
        tree += [hip, knee_q, angle, knee.extension(robot.leg, bend)]
    return ca.vertcat(*tree)


def _coordinates(robot: Robot) -> tuple[tuple[Quantity, ...], tuple[Quantity, ...]]:
    bends = sorted(knee.flexion(robot.leg, x) for x in (0.0, robot.stroke))
    slack = 0.05  # the end stops hold the knee; these bounds only keep solvers out of trouble
    q = [
        Quantity("body/x", "m", -5.0, 5.0, 0.1, doc="body centre, forward"),
        Quantity("body/z", "m", 0.0, 3.0, 0.1, doc="body centre, height above the ground"),
        Quantity("body/pitch", "rad", -np.inf, np.inf, 0.2, doc="nose up positive"),
    ]
    q += [
        Quantity(f"{leg}/hip/q", "rad", -HIP_RANGE, HIP_RANGE, 0.5, doc="femur against body")
        for leg in robot.legs
    ]
    for leg, place in robot.legs.items():
        low, high = sorted(place.fold * b for b in (bends[0] - slack, bends[1] + slack))
        q.append(Quantity(f"{leg}/knee/q", "rad", low, high, 0.5, doc="tibia against femur"))
    v = [
        Quantity("body/vx", "m.s-1", -20, 20, 1.0, doc="body centre, forward"),
        Quantity("body/vz", "m.s-1", -20, 20, 1.0, doc="body centre, upward"),
        Quantity("body/pitch_rate", "rad.s-1", -50, 50, 2.0, doc="nose up positive"),
    ]
    for joint in ("hip", "knee"):
        v += [
            Quantity(f"{leg}/{joint}/w", "rad.s-1", -100, 100, 5.0, doc=f"{joint} rate")
            for leg in robot.legs
        ]
    return tuple(q), tuple(v)


def _ports(robot: Robot, q: ca.SX, points: dict[str, Vector]) -> dict[str, Port]:
    legs = len(robot.legs)
    ports = [
        _port("body/x", "body/vx", "m", q[0], "body centre, forward"),
        _port("body/z", "body/vz", "m", q[1], "body centre, height"),
        _port("body/pitch", "body/pitch_rate", "rad", q[2], "nose up positive"),
    ]
    for i, (leg, place) in enumerate(robot.legs.items()):
        x = knee.extension(robot.leg, place.fold * q[3 + legs + i])
        ports += [
            _port(f"{leg}/hip/q", f"{leg}/hip/w", "rad", q[3 + i], "femur against body"),
            _port(f"{leg}/knee/q", f"{leg}/knee/w", "rad", q[3 + legs + i], "tibia against femur"),
            _port(f"{leg}/piston/x", f"{leg}/piston/v", "m", x, "piston extension, 0 retracted"),
        ]
        for point in (f"{leg}/foot", f"{leg}/knee", f"{leg}/hip"):
            for axis, phi in zip("xz", points[point], strict=True):
                doc = f"{point.removeprefix(f'{leg}/')} position, {axis}"
                ports.append(_port(f"{point}/{axis}", f"{point}/v{axis}", "m", phi, doc))
    return {p.quantity.name: p for p in ports}


def _points(robot: Robot, motions: dict[str, FrameMotion]) -> dict[str, Vector]:
    """Where each leg's hip, knee and foot are, and its cylinder's pivot and its rod's pin."""
    points: dict[str, Vector] = {}
    for leg in robot.legs:
        hip, tibia = motions[f"{leg}/hip"], motions[f"{leg}/knee"]
        sole = tibia.turn((0.0, -robot.leg.tibia.length))
        foot = (tibia.position[0] + sole[0], tibia.position[1] + sole[1])
        places = {
            "hip": hip.position,
            "knee": tibia.position,
            "foot": foot,
            "mount": motions[f"{leg}/cylinder"].position,
            "pin": motions[f"{leg}/rod"].position,
        }
        points |= {f"{leg}/{place}": at for place, at in places.items()}
    return points


def _port(name: str, rate: str, unit: str, phi: ca.SX, doc: str) -> Port:
    return Port(Quantity(name, unit, doc=doc), Quantity(rate, f"{unit}.s-1", doc=doc), phi)


def _mirror(robot: Robot) -> dict[str, str]:
    """Left-right mirror of the plane for a robot with one leg on either side; {} if it has none."""
    if len(robot.legs) != 2:
        return {}
    (a, pa), (b, pb) = robot.legs.items()
    if pa.hip != -pb.hip or pa.fold != -pb.fold:
        return {}
    mirror = {"body/x": "-body/x", "body/z": "body/z", "body/pitch": "-body/pitch"}
    for joint in ("hip", "knee"):
        mirror |= {f"{a}/{joint}/q": f"-{b}/{joint}/q", f"{b}/{joint}/q": f"-{a}/{joint}/q"}
    return mirror
