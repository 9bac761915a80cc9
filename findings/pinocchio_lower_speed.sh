#!/usr/bin/env bash
# Speed limits of a robot: the lower one is the upper one.
#
# Guess, written before the run: a URDF with velocity="2" gives lowerVelocityLimit -2 and
# upperVelocityLimit 2, as effort="5" gives -5 and 5; the free base has -inf and inf.
#
# Seen (pin 4.1.0): effort is -5 and 5, but speed 2 and 2, from URDF and from addJoint, also where
# addJoint is given -1 and 2; from MJCF, without a limit, inf and inf. The base has the largest
# number there is on both sides. In a program with these bounds every joint has one speed left,
# and the slowest motion of this hip is 2 rad/s. `velocityLimit`, which the pair is to replace, is
# right; it is the upper limit by another name, so that setting it to 4 leaves speeds between 2
# and 4.
#
# Why it matters: the pair is new in Pinocchio 4, symmetric limits are called deprecated, and the
# natural line `lbx=model.lowerVelocityLimit, ubx=model.upperVelocityLimit` pins every speed. Use
# minus the upper limit until the lower one differs from it.
#
# Read: the wheel's headers (model.hpp calls velocityLimit deprecated in favour of the pair).
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet pin==4.1.0 casadi==3.8.2 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys
import tempfile
from pathlib import Path

import casadi as ca
import numpy as np
import pinocchio as pin

LEG = """<robot name="leg"><link name="body"/><link name="thigh"><inertial><mass value="1"/>
<origin xyz="0 0 -0.1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
</link><joint name="hip" type="revolute"><parent link="body"/><child link="thigh"/>
<axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="5" velocity="2"/></joint></robot>"""
HINGE = """<mujoco><worldbody><body name="thigh"><joint name="hip" type="hinge" axis="0 1 0"
actuatorfrcrange="-5 5"/><geom size="0.05" mass="1"/></body></worldbody></mujoco>"""
print("pin", pin.__version__)


def speeds(model):
    return model.lowerVelocityLimit.tolist(), model.upperVelocityLimit.tolist()


leg = pin.buildModelFromXML(LEG)
floating = pin.buildModelFromXML(LEG, pin.JointModelFreeFlyer())
file = Path(tempfile.mkdtemp()) / "hinge.xml"
file.write_text(HINGE)
hinge = pin.buildModelFromMJCF(str(file))
by_hand = pin.Model()
axis, still = pin.JointModelRY(), pin.SE3.Identity()
pairs = (-5.0, 5.0), (-1.0, 2.0), (-3.0, 3.0), (0.0, 0.0)  # effort, speed, angle, friction
limits = [np.array([limit]) for pair in pairs for limit in pair]
by_hand.addJoint(0, axis, still, "hip", *limits, np.zeros(1))  # no damping

print("URDF: effort", leg.lowerEffortLimit.tolist(), leg.upperEffortLimit.tolist())
print("URDF: speed ", *speeds(leg))
print("on a free base:", *(sorted(set(side)) for side in speeds(floating)))
print("MJCF:", *speeds(hinge))
print("addJoint with -1 and 2:", *speeds(by_hand))
leg.velocityLimit = np.array([4.0])
print("velocityLimit set to 4:", *speeds(leg))

v = ca.SX.sym("v", floating.nv)
quiet = {"ipopt.print_level": 0, "print_time": 0, "ipopt.sb": "yes", "error_on_fail": False}
slow = ca.nlpsol("slow", "ipopt", {"x": v, "f": ca.sumsqr(v)}, quiet)
low, high = (np.array(side) for side in speeds(floating))
low[:6] = -high[:6]  # the base is free
found = slow(lbx=low, ubx=high)
print("slowest hip between its limits:", float(found["x"][6]), "rad/s")

if leg.lowerEffortLimit.tolist() != [-5.0]:
    sys.exit("changed: the lower effort limit of a URDF was minus the upper one")
if speeds(floating)[0] != speeds(floating)[1] or speeds(by_hand) != ([2.0], [2.0]):
    sys.exit("changed: lower speed limits of URDF and addJoint are no longer the upper ones")
if speeds(hinge) != ([np.inf], [np.inf]) or speeds(leg) != ([2.0], [4.0]):
    sys.exit("changed: MJCF, or velocityLimit, now sets the lower limit")
if abs(float(found["x"][6]) - 2.0) > 1e-6:
    sys.exit("changed: these bounds no longer pin the speed")
EOF
