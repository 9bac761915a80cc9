#!/usr/bin/env bash
# A payload without joints takes the armature off the whole robot: Pinocchio's appendModel.
#
# Guess, written before the run: buildReducedModel and appendModel keep armature, limits and
# friction of the joints that stay.
#
# Seen (pin 4.1.0): buildReducedModel does. appendModel keeps limits, damping, friction,
# rotorInertia and rotorGearRatio, sets the armature of every joint of both models to 0 and gravity
# to 9.81 m/s2 down, without a warning. A box of 0.5 kg that has no joint is enough: 20 N.m at the
# hip of a leg with 0.05 kg.m2 of rotor accelerate it by 221 rad/s2 instead of 136, 62 % more.
# appendBodyToJoint adds the same box and keeps both; after appendModel, armature and gravity set
# again give the same.
#
# Why it matters: robots are put together of a trunk and two legs, and payloads are hung on for
# plans that shall carry them. The plan for the loaded robot is then of a faster machine than that
# for the empty one, and none of kinematics, weights, limits or regressors of torque shows it (the
# regressors have no armature to begin with, pinocchio_regressor_armature.sh). Compare armature
# before and after.
#
# Read: docstring of appendModel (nothing on it); Pinocchio's issue 2746 (buildReducedModel lost
# armature, closed).
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet pin==4.1.0 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import numpy as np
import pinocchio as pin

np.set_printoptions(precision=3, suppress=True)
inertial = (
    '<inertial><origin xyz="0 0 {0}"/><mass value="{1}"/>'
    '<inertia ixx="{2}" iyy="{2}" izz="{2}" ixy="0" ixz="0" iyz="0"/></inertial>'
)
joint = (
    '<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/>'
    '<origin xyz="0 0 {3}"/><axis xyz="0 1 0"/><dynamics damping="0.1" friction="0.3"/>'
    '<limit lower="-2" upper="2" effort="50" velocity="20"/></joint>'
)
fields = ("armature", "rotorInertia", "rotorGearRatio", "damping", "friction", "effortLimit")
rotors = np.array([0.05, 0.001])
print("pin", pin.__version__)


def leg(side):
    model = pin.buildModelFromXML(
        f'<robot name="leg"><link name="{side}_base"/>'
        f'<link name="{side}_thigh">{inertial.format(-0.15, 2.0, 0.02)}</link>'
        f'<link name="{side}_shank">{inertial.format(-0.12, 0.8, 0.006)}</link>'
        + joint.format(f"{side}_hip", f"{side}_base", f"{side}_thigh", 0)
        + joint.format(f"{side}_knee", f"{side}_thigh", f"{side}_shank", -0.3)
        + "</robot>"
    )
    model.armature = rotors
    model.rotorInertia, model.rotorGearRatio = rotors / 36, np.array([6.0, 6.0])
    model.gravity.linear = np.array([0.0, 0.0, -5.0])
    return model


def push(model):
    """Acceleration of the hip under 20 N.m, hanging."""
    torque = np.zeros(model.nv)
    torque[0] = 20.0
    return pin.aba(model, model.createData(), pin.neutral(model), np.zeros(model.nv), torque)[0]


def kept(model):
    """Fields of the first two joints that are as they were."""
    return [name for name in fields if np.allclose(getattr(model, name)[:2], getattr(whole, name))]


whole = leg("left")
box = pin.buildModelFromXML(
    f'<robot name="box"><link name="box">{inertial.format(0, 0.5, 0.001)}</link></robot>'
)
here = pin.SE3.Identity()
loaded = pin.appendModel(whole, box, whole.getFrameId("left_thigh"), here)
both = pin.appendModel(whole, leg("right"), 0, here)
reduced = pin.buildReducedModel(whole, [2], np.zeros(2))
added = whole.copy()
added.appendBodyToJoint(1, pin.Inertia(0.5, np.zeros(3), 0.001 * np.eye(3)), here)
mended = loaded.copy()
mended.armature, mended.gravity = whole.armature, whole.gravity
for name, model in (
    ("the leg", whole),
    ("with a box of 0.5 kg appended", loaded),
    ("with the other leg appended", both),
    ("box by appendBodyToJoint", added),
    ("box appended, armature set again", mended),
):
    print(
        f"{name:32s} armature {model.armature}, {push(model):5.1f} rad/s2 at 20 N.m,"
        f" gravity {model.gravity.linear[2]:.2f}"
    )
print("fields kept by appendModel:", kept(loaded), kept(both))
print("armature after buildReducedModel without the knee:", reduced.armature)

if kept(loaded) != list(fields[1:]) or loaded.armature.any():
    sys.exit("changed: appendModel keeps armature with a payload, or loses other fields")
if kept(both) != list(fields[1:]) or both.armature.any():
    sys.exit("changed: appendModel keeps armature of two legs, or loses other fields")
if loaded.inertias[1].mass != 2.5 or loaded.gravity.linear[2] != -9.81:
    sys.exit("changed: the payload's mass or the gravity that was set comes out otherwise")
if not (np.allclose(added.armature, rotors) and np.allclose(reduced.armature, rotors[:1])):
    sys.exit("changed: appendBodyToJoint or buildReducedModel now lose armature")
if push(loaded) < 1.3 * push(mended) or abs(push(mended) / push(added) - 1) > 1e-9:
    sys.exit("changed: the hip no longer accelerates a third more, or the cure is none")
EOF
