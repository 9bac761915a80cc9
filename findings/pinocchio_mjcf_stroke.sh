#!/usr/bin/env bash
# One MJCF file, two strokes: Pinocchio turns the metres of slide joints from degrees into radians.
#
# Guess, written before the run: of one MJCF file MuJoCo and Pinocchio make the same model.
#
# Seen (pin 4.1.0, mujoco 4.0.0): Pinocchio multiplies the range of *every* joint by pi/180. A
# stroke of 0.1 m becomes 1.7 mm, a base height of 0.2 to 1.2 m becomes 3.5 to 21 mm.
# `limited="false"` is not read: the range stays a limit. MuJoCo reads both as its reference says.
# Masses, places of bodies, armature and friction loss of the same file agree to rounding. With
# `angle="radian"` the ranges agree too.
#
# Why it matters: pneumatic strokes and a boom's height are slide joints. A planner that takes its
# limits from Pinocchio and its rollouts from MuJoCo plans within 1.7 % of the stroke, with no error
# anywhere; "infeasible" is what is met first. Write angle="radian", or compare both ranges on load.
#
# Read: MuJoCo's XML reference (compiler/angle; joint/range: "degrees or radians" for hinges and
# balls, length units for slides; joint/limited), Pinocchio's docstring of buildModelFromMJCF.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet pin==4.1.0 mujoco==4.0.0 numpy==2.4.6
"$work/venv/bin/python" - "$work/leg.xml" <<'EOF'
import sys
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin

path = Path(sys.argv[1])
text = """<mujoco>
  <compiler angle="{angle}"/>
  <worldbody>
    <body name="base">
      <joint name="height" type="slide" axis="0 0 1" range="0.2 1.2"/>
      <inertial pos="0 0 0" mass="5" diaginertia="0.1 0.1 0.1"/>
      <body name="cylinder">
        <joint name="swing" type="hinge" axis="0 1 0" {swing}/>
        <inertial pos="0 0 -0.1" mass="0.6" diaginertia="0.01 0.01 0.01"/>
        <body name="rod">
          <joint name="stroke" type="slide" axis="0 0 1" range="0 0.1" armature="0.05"/>
          <inertial pos="0 0 -0.2" mass="0.2" diaginertia="0.01 0.01 0.01"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
print("pin", pin.__version__, "mujoco", mujoco.__version__)


def read(angle, swing):
    path.write_text(text.format(angle=angle, swing=swing))
    return pin.buildModelFromMJCF(str(path)), mujoco.MjModel.from_xml_path(str(path))


ours, theirs = read("degree", 'limited="false" range="-40 40"')
limits = np.column_stack([ours.lowerPositionLimit, ours.upperPositionLimit])
for row, name in enumerate(("height", "swing", "stroke")):
    limited = "a limit" if theirs.jnt_limited[row] else "no limit"
    print(f"{name:7s} pinocchio {limits[row]}  mujoco {theirs.jnt_range[row]} ({limited})")
radian, theirs_radian = read("radian", 'range="-0.7 0.7"')
print("radian  pinocchio", radian.upperPositionLimit, " mujoco", theirs_radian.jnt_range[:, 1])

weights = pin.crba(ours, ours.createData(), np.array([0.5, 0.3, 0.05]))
weights = np.triu(weights) + np.triu(weights, 1).T
data = mujoco.MjData(theirs)
data.qpos[:] = [0.5, 0.3, 0.05]
mujoco.mj_forward(theirs, data)
same = np.zeros((3, 3))
mujoco.mj_fullM(theirs, data, same)
print("joint-space inertia differs by", abs(weights - same).max())

if abs(same - weights).max() > 1e-12:
    sys.exit("changed: the two no longer agree on inertia")
if not np.allclose(limits[[0, 2]], np.radians(theirs.jnt_range[[0, 2]])):
    sys.exit("changed: ranges of slide joints are no longer scaled by pi/180")
if not np.isfinite(limits[1]).all() or theirs.jnt_limited[1]:
    sys.exit('changed: limited="false" is now read by Pinocchio, or no longer by MuJoCo')
if not np.allclose(radian.upperPositionLimit, theirs_radian.jnt_range[:, 1]):
    sys.exit('changed: with angle="radian" the two no longer agree')
EOF
