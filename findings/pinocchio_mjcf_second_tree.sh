#!/usr/bin/env bash
# A closed loop in MJCF: Pinocchio reads the first body of the world and drops the others.
#
# Guess, written before the run: a world with two bodies is read with both; an `equality/connect`
# becomes a constraint or is left out.
#
# Seen (pin 4.1.0, mujoco 4.0.0): buildModelFromMJCF keeps the first body and what hangs on it. The
# second tree, its joints and its mass are gone without a word: one joint of three, 3 kg of 3.8 kg.
# Which machine is left depends on the order of the two in the file. Only
# buildModelAndConstraintsFromMJCF notices, by a ValueError that names a body that the file has.
# Hung below one body without a joint, the same parts are all read, with their constraint.
#
# Why it matters: a pneumatic cylinder between frame and shank, a boom, a treadmill or a ball are
# second trees. Inverse dynamics of what is left is smooth, plausible and of another machine. Count
# nv and mass against MuJoCo's on load, or give the world one body that carries all.
#
# Read: MuJoCo's XML reference (worldbody: any number of bodies), docstrings of both functions;
# Pinocchio's issue 2782 (pose of a first body without joint dropped: closed, still so in 4.1.0).
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet pin==4.1.0 mujoco==4.0.0 numpy==2.4.6
"$work/venv/bin/python" - "$work/loop.xml" <<'EOF'
import sys
from pathlib import Path

import mujoco
import pinocchio as pin

path = Path(sys.argv[1])
leg = """<body name="shank" pos="0 0 1">
  <joint name="knee" axis="0 1 0"/>
  <inertial pos="0 0 -0.2" mass="3" diaginertia="0.02 0.02 0.01"/>
</body>"""
actuator = """<body name="cylinder" pos="0.1 0 1.1">
  <joint name="trunnion" axis="0 1 0"/>
  <inertial pos="0 0 -0.1" mass="0.6" diaginertia="0.002 0.002 0.001"/>
  <body name="rod" pos="0 0 -0.2">
    <joint name="stroke" type="slide" axis="0 0 1"/>
    <inertial pos="0 0 0" mass="0.2" diaginertia="0.001 0.001 0.001"/>
  </body>
</body>"""
print("pin", pin.__version__, "mujoco", mujoco.__version__)


def write(bodies):
    path.write_text(f"""<mujoco>
<worldbody>{bodies}</worldbody>
<equality><connect body1="rod" body2="shank" anchor="0 0 0"/></equality>
</mujoco>""")
    return str(path)


def summary(bodies):
    model = pin.buildModelFromMJCF(write(bodies))
    return list(model.names)[1:], round(pin.computeTotalMass(model), 6)


first, other = summary(leg + actuator), summary(actuator + leg)
whole = mujoco.MjModel.from_xml_path(write(leg + actuator))
names = [whole.joint(index).name for index in range(whole.njnt)]
print("mujoco                       ", names, "mass", round(whole.body_subtreemass[0], 6))
print("pinocchio, leg first         ", *first)
print("pinocchio, cylinder first    ", *other)
try:
    pin.buildModelAndConstraintsFromMJCF(write(leg + actuator))
    complaint = None
except ValueError as error:
    complaint = str(error)
print("with constraints asked for:  ", complaint)
frame = f'<body name="frame">{leg}{actuator}</body>'
below = summary(frame)
points, frames = pin.buildModelAndConstraintsFromMJCF(write(frame))[1:]
print("pinocchio, below one body    ", *below, "constraints", len(points) + len(frames))

if names != ["knee", "trunnion", "stroke"]:
    sys.exit("changed: MuJoCo no longer reads three joints")
if first != (["knee"], 3.0) or other != (["trunnion", "stroke"], 0.8):
    sys.exit("changed: Pinocchio no longer drops the second tree")
if complaint is None:
    sys.exit("changed: constraints to a dropped body are no longer refused")
if sorted(below[0]) != sorted(names) or len(points) + len(frames) != 1:
    sys.exit("changed: below one body the parts and their constraint are no longer all read")
EOF
