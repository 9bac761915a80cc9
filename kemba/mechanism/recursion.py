"""Planar Newton-Euler recursion over CasADi SX that reads a pin.Model.

Classical linear accelerations in the world frame: every joint adds one angle, so vectors are
never rotated back and forth. Equal to pin.rnea on the same model (tests/oracle).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin

Vector = tuple[ca.SX, ca.SX]
Local = np.ndarray | tuple[Any, Any]  # (x, z) in a frame, numbers or symbols


@dataclass(frozen=True)
class Joint:
    """What the recursion needs of one joint: placement, axis, and the inertia it carries, which may
    be symbols."""

    name: str
    parent: int
    offset: Local
    turns: float  # +-1 about the counter-clockwise axis, 0 for a prismatic joint
    slides: np.ndarray  # unit axis in (x, z), zero for a revolute joint
    mass: Any
    com: np.ndarray
    inertia: Any
    armature: float

    @property
    def heavy(self) -> bool:
        """Whether it carries a link."""
        return isinstance(self.mass, ca.SX) or bool(self.mass)


@dataclass(frozen=True)
class FrameMotion:
    """Where a joint's frame is and how it moves: position, angle's cosine and sine, rates."""

    angle: ca.SX
    cos: ca.SX
    sin: ca.SX
    position: Vector
    rate: ca.SX
    acceleration: Vector
    angular: ca.SX

    def turn(self, local: Local) -> Vector:
        """A vector (2,) of this frame, in the world."""
        return (
            self.cos * local[0] - self.sin * local[1],
            self.sin * local[0] + self.cos * local[1],
        )

    def carry(self, arm: Vector) -> Vector:
        """Acceleration of the point at `arm` from this frame's origin."""
        rr = self.rate**2
        return (
            self.acceleration[0] - self.angular * arm[1] - rr * arm[0],
            self.acceleration[1] + self.angular * arm[0] - rr * arm[1],
        )


def read_joints(model: pin.Model) -> list[Joint]:
    """The joints of a planar pin.Model, parents first. Raises ValueError if not planar."""
    joints = []
    for i in range(1, model.njoints):
        subspace = np.asarray(model.joints[i].createData().S).reshape(6)
        placement, inertia = model.jointPlacements[i], model.inertias[i]
        if not np.allclose(placement.rotation, np.eye(3)) or np.any(subspace[[1, 3, 5]]):
            raise ValueError(f"joint {model.names[i]} leaves the x-z plane or is turned")
        joints.append(
            Joint(
                name=model.names[i],
                parent=model.parents[i] - 1,
                offset=placement.translation[[0, 2]],
                turns=-subspace[4],
                slides=subspace[[0, 2]],
                mass=inertia.mass,
                com=inertia.lever[[0, 2]],
                inertia=inertia.inertia[1, 1],
                armature=model.armature[model.joints[i].idx_v],
            )
        )
    return joints


def forward(joints: list[Joint], q: ca.SX, v: ca.SX, a: ca.SX, gravity: float) -> list[FrameMotion]:
    """Motion of every joint frame [m, rad, s], parents first.

    `q`, `v`, `a` (n,): positions, velocities and accelerations of the tree's joints; `gravity`
    [m.s-2] enters as an upward acceleration of the base.
    """
    zero = ca.SX(0)
    base = FrameMotion(zero, ca.SX(1), zero, (zero, zero), zero, (zero, ca.SX(gravity)), zero)
    motions: list[FrameMotion] = []
    for i, joint in enumerate(joints):
        parent = base if joint.parent < 0 else motions[joint.parent]
        motions.append(_step(joint, parent, q[i], v[i], a[i]))
    return motions


def _step(joint: Joint, parent: FrameMotion, q: ca.SX, v: ca.SX, a: ca.SX) -> FrameMotion:
    if joint.turns:
        arm = parent.turn(joint.offset)
        angle = parent.angle + joint.turns * q
        return FrameMotion(
            angle,
            ca.cos(angle),
            ca.sin(angle),
            (parent.position[0] + arm[0], parent.position[1] + arm[1]),
            parent.rate + joint.turns * v,
            parent.carry(arm),
            parent.angular + joint.turns * a,
        )
    axis = parent.turn(joint.slides)
    start = parent.turn(joint.offset)
    arm = (start[0] + axis[0] * q, start[1] + axis[1] * q)
    carried = parent.carry(arm)
    coriolis = 2 * parent.rate * v
    acceleration = (
        carried[0] + axis[0] * a - coriolis * axis[1],
        carried[1] + axis[1] * a + coriolis * axis[0],
    )
    position = (parent.position[0] + arm[0], parent.position[1] + arm[1])
    return FrameMotion(
        parent.angle, parent.cos, parent.sin, position, parent.rate, acceleration, parent.angular
    )


def rnea(joints: list[Joint], q: ca.SX, v: ca.SX, a: ca.SX, gravity: float) -> ca.SX:
    """Inverse dynamics of the tree: generalised forces (n,) [N or N.m] for motion (q, v, a)."""
    motions = forward(joints, q, v, a, gravity)
    zero = ca.SX(0)
    force: list[Vector] = [(zero, zero)] * len(joints)
    moment = [zero] * len(joints)
    tau: list[ca.SX] = [zero] * len(joints)
    for i in reversed(range(len(joints))):
        joint, motion = joints[i], motions[i]
        if joint.heavy:
            com = motion.turn(joint.com)
            ax, az = motion.carry(com)
            inertial = (joint.mass * ax, joint.mass * az)
            moment[i] += joint.inertia * motion.angular + _cross(com, inertial)
            force[i] = (force[i][0] + inertial[0], force[i][1] + inertial[1])
        tau[i] = _along(joint, motion, force[i], moment[i]) + joint.armature * a[i]
        if joint.parent >= 0:
            parent = motions[joint.parent]
            arm = (motion.position[0] - parent.position[0], motion.position[1] - parent.position[1])
            moment[joint.parent] += moment[i] + _cross(arm, force[i])
            above = force[joint.parent]
            force[joint.parent] = (above[0] + force[i][0], above[1] + force[i][1])
    return ca.vertcat(*tau)


def _along(joint: Joint, motion: FrameMotion, force: Vector, moment: ca.SX) -> ca.SX:
    if joint.turns:
        return joint.turns * moment
    axis = motion.turn(joint.slides)
    return axis[0] * force[0] + axis[1] * force[1]


def _cross(arm: Vector, force: Vector) -> ca.SX:
    return arm[0] * force[1] - arm[1] * force[0]


def link_tolerances(joints: Iterable[Joint], shares: Mapping[str, float]) -> dict[str, float]:
    """1 sigma of every figure that may be off, as a share of it, by `leg/link.figure`.

    Links are named by the joint that carries them: `front/hip.mass` is that of the front femur.
    `shares`: 1 sigma by figure; figures with 0 are known exactly and left out.
    """
    unsure = {figure: share for figure, share in shares.items() if share}
    heavy = (joint.name for joint in joints if joint.mass)
    return {f"{name}.{figure}": share for name in heavy for figure, share in unsure.items()}


def link_forces(
    joints: Sequence[Joint],
    figures: Sequence[str],
    motion: tuple[ca.SX, ca.SX, ca.SX],
    gravity: float,
) -> ca.SX:
    """Generalised forces (joints, figures) per share by which each of `figures` is off.

    `motion`: angles, rates and accelerations (joints,) of the opened tree. Figures are named as in
    `link_tolerances`.
    """
    share = ca.SX.sym("share", len(figures))
    off = {name: share[i] for i, name in enumerate(figures)}

    def scaled(joint: Joint) -> Joint:
        mass, inertia = (1.0 + off.get(f"{joint.name}.{f}", 0.0) for f in ("mass", "inertia"))
        return replace(joint, mass=joint.mass * mass, inertia=joint.inertia * inertia)

    # the force is linear in what links weigh
    return ca.jacobian(rnea([scaled(joint) for joint in joints], *motion, gravity), share)
