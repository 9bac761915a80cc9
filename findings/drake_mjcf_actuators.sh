#!/usr/bin/env bash
# One MJCF file, two robots: Drake's motors have a tenth of the torque, servos no damping, and
# joints without a motor no armature.
#
# Guess, written before the run: Drake reads `gear`, `armature` and `position` (its release notes
# name them) and warns of what it leaves out; a file that it reads without a warning has the mass
# matrix, gains and limits that MuJoCo has.
#
# Seen (drake 1.51.1, also 1.58.0; mujoco 4.0.0), all without a warning:
# - A motor with gear 10 and ctrlrange -3 3 gives 30 Nm at its joint in MuJoCo. Drake's gear ratio
#   serves the rotor's inertia alone; its input is torque at the joint, and its effort limit there
#   is 3. forcerange is taken in the same way.
# - A position servo with kp 50, kv 2 and gear 2 has a stiffness of 200 Nm/rad and a damping of 8
#   Nms/rad in MuJoCo. Drake has 50 and 0: kv is not read, with gear 1 neither.
# - Armature belongs to the joint. Drake puts it into the actuator, as rotor inertia, and where
#   there is none it is lost: a passive ankle has 0.021 kg m^2 in MuJoCo, 0.001 in Drake. Knees
#   that a `general` or a `cylinder` drives, the pneumatic ones, lose it too; there Drake warns of
#   the actuator that it leaves out, and not of the inertia.
#
# Why it matters: plans made in Drake and tried in MuJoCo, or the other way. Within the limits that
# Drake reads a jump may have no solution; servos swing that stood still; a light foot accelerates
# twenty times as fast. Multiply limits by the gear, gains by its square, set damping by hand, and
# add actuators with rotor inertia for the joints without one.
#
# Read: Drake's documentation of JointActuator and of parsing, its pull request 21967.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet drake==1.51.1 mujoco==4.0.0 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import logging
import sys
from importlib.metadata import version

import mujoco
import numpy as np
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

LEG = """<mujoco model="leg"><default><joint type="hinge" axis="0 1 0" armature="0.02"/></default>
<worldbody><body><joint name="hip"/><geom type="capsule" size="0.05" fromto="0 0 0 0 0 -0.3"/>
<body pos="0 0 -0.3"><joint name="knee"/><geom type="capsule" size="0.03" fromto="0 0 0 0 0 -0.3"/>
<body pos="0 0 -0.3"><joint name="ankle"/><geom type="box" size="0.08 0.03 0.01" mass="0.5"/>
</body></body></body></worldbody>
<actuator><motor name="hip" joint="hip" gear="10" ctrlrange="-3 3"/>{knee}</actuator></mujoco>"""
SERVO = '<position name="knee" joint="knee" kp="50" kv="2" gear="{}"/>'
said = []
logger = logging.getLogger("drake")
logger.handlers = [logging.Handler()]
logger.handlers[0].emit = said.append
print("drake", version("drake"), "mujoco", mujoco.__version__)


def in_mujoco(text):
    """Diagonal of the mass matrix, largest torque at the hip, stiffness and damping at the knee."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    mass = np.zeros((3, 3))
    mujoco.mj_fullM(model, data, mass)

    def torque(ctrl=(0.0, 0.0), angle=0.0, speed=0.0):
        data.ctrl[:], data.qpos[1], data.qvel[1] = ctrl[: model.nu], angle, speed
        mujoco.mj_forward(model, data)
        return data.qfrc_actuator.copy()

    gains = [abs(float(torque(**{name: 0.1})[1])) / 0.1 for name in ("angle", "speed")]
    return np.diag(mass), float(torque((99.0, 0.0))[0]), gains


def in_drake(text):
    said.clear()
    plant = MultibodyPlant(0.001)
    Parser(plant).AddModelsFromString(text, "xml")
    plant.Finalize()
    torques = plant.MakeActuationMatrix()  # joints' torques by inputs
    limit = torques[0, 0] * plant.GetJointActuatorByName("hip").effort_limit()
    gains = [0.0, 0.0]
    if plant.HasJointActuatorNamed("knee"):
        found = plant.GetJointActuatorByName("knee").get_controller_gains()
        gains = [float(found.p), float(found.d)]
    mass = plant.CalcMassMatrix(plant.CreateDefaultContext())
    return np.diag(mass), float(limit), gains, len(said)


knees = {
    "servo, gear 2": SERVO.format(2),
    "servo, gear 1": SERVO.format(1),
    "cylinder": '<cylinder name="knee" joint="knee" area="0.001" timeconst="0.01"/>',
}
seen = {}
for words, knee in knees.items():
    text = LEG.format(knee=knee)
    ours, theirs = in_mujoco(text), in_drake(text)
    seen[words] = ours, theirs
    for tool, (mass, limit, gains, *warnings) in (("MuJoCo", ours), ("Drake", theirs)):
        print(
            f"{words:13s} {tool:6s} mass matrix {mass.round(4)}, hip {limit:.0f} Nm,"
            f" knee: stiffness {gains[0]:.0f}, damping {gains[1]:.0f}",
            f"; {warnings[0]} warnings" if warnings else "",
        )

(mass, limit, gains), (drakes, low, weak, warned) = seen["servo, gear 2"]
lost = mass - drakes
if warned:
    sys.exit("changed: Drake warns of something in the first file: " + said[0].getMessage())
if round(limit) != 30 or round(low) != 3:
    sys.exit("changed: torque of a motor with a gear")
if not np.allclose(gains + weak, [200, 8, 50, 0]) or seen["servo, gear 1"][1][2] != [50, 0]:
    sys.exit("changed: gains of a position servo")
if not np.allclose(lost, [0, 0, 0.02], atol=1e-6):
    sys.exit("changed: armature of a joint without a motor")
ours, theirs = seen["cylinder"]
if not np.allclose(ours[0] - theirs[0], [0, 0.02, 0.02], atol=1e-6) or theirs[3] != 1:
    sys.exit("changed: a knee with a cylinder, or what Drake says of it")
EOF
