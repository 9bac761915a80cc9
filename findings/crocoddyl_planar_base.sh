#!/usr/bin/env bash
# A planar robot in Crocoddyl, its base drawn as three joints: motors hold it up in the air.
#
# Guess, written before the run: `ActuationModelFloatingBase` leaves out the joints of the base,
# however these are drawn; a base of x, z and pitch, as planar URDF and MJCF files have it, leaves
# the hips.
#
# Seen (crocoddyl 3.2.1, pin 4.0.0): only the first joint counts as the base. With a slide in x, a
# slide in z and a hinge, `nu` is 4 instead of 2: height and pitch of the body have motors without
# limits. Asked to stay 1 m above the ground without any contact, the solver does so with 58.86 N
# upwards, the robot's weight. Calling the first joint `root_joint` changes nothing. One composite
# joint (x, z, pitch) or Pinocchio's planar joint leave the two hips, and the robot falls.
#
# Why it matters: jumps are then found that need no ground; contacts and legs look idle, which
# reads like a cheap plan. Look at `nu` before anything else.
#
# Read: Crocoddyl's documentation of ActuationModelFloatingBase, Pinocchio's of composite joints.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet crocoddyl==3.2.1 pin==4.0.0 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import crocoddyl
import numpy as np
import pinocchio as pin

print(f"crocoddyl {crocoddyl.__version__}, pin {pin.__version__}")
PLANE = {"root_joint": pin.JointModelPX(), "z": pin.JointModelPZ(), "pitch": pin.JointModelRY()}


def robot(base):
    """A body of 5 kg with two legs of 0.5 kg in the plane."""
    model, here, body = pin.Model(), pin.SE3.Identity(), 0
    if base == "three joints":
        for name, joint in PLANE.items():
            body = model.addJoint(body, joint, here, name)
    else:
        joint = pin.JointModelComposite(PLANE["root_joint"])
        joint.addJoint(PLANE["z"])
        joint.addJoint(PLANE["pitch"])
        body = model.addJoint(0, joint, here, "root_joint")
    model.appendBodyToJoint(body, pin.Inertia(5.0, np.zeros(3), np.eye(3)), here)
    for name, x in (("front", 0.25), ("rear", -0.25)):
        place = pin.SE3(np.eye(3), np.array([x, 0.0, 0.0]))
        hip = model.addJoint(body, pin.JointModelRY(), place, name)
        leg = pin.Inertia(0.5, np.array([0.0, 0.0, -0.1]), 0.01 * np.eye(3))
        model.appendBodyToJoint(hip, leg, here)
    return model


found = {}
for base in ("three joints", "one joint"):
    state = crocoddyl.StateMultibody(robot(base))
    motors = crocoddyl.ActuationModelFloatingBase(state)
    start = state.zero()
    start[1] = 1.0
    stay = crocoddyl.CostModelSum(state, motors.nu)
    wish = crocoddyl.ResidualModelState(state, start, motors.nu)
    effort = crocoddyl.ResidualModelControl(state, motors.nu)
    stay.addCost("x", crocoddyl.CostModelResidual(state, wish), 1e3)
    stay.addCost("u", crocoddyl.CostModelResidual(state, effort), 1e-6)
    free = crocoddyl.DifferentialActionModelFreeFwdDynamics(state, motors, stay)
    step, end = (crocoddyl.IntegratedActionModelEuler(free, dt) for dt in (0.01, 0.0))
    solver = crocoddyl.SolverFDDP(crocoddyl.ShootingProblem(start, [step] * 50, end))
    solver.solve([start] * 51, [np.zeros(motors.nu)] * 50, 100)
    height, pushed = float(solver.xs[-1][1]), np.round(solver.us[25], 2).tolist()
    found[base] = motors.nu, round(height, 2), pushed[0]
    print(f"{base}: nu {motors.nu}, {height:.2f} m high after 0.5 s, inputs {pushed}")
if found["three joints"] != (4, 1.0, 58.86) or found["one joint"][:2] != (2, -0.25):
    sys.exit("changed: what counts as the base")
EOF
