#!/usr/bin/env bash
# A planar loop closed by a point: Pinocchio's constraint dynamics answers nan, and raises nothing.
#
# Guess, written before the run: for three links that move in a plane, closed by a 3D point
# constraint whose row across the plane is empty, constraintDynamics with its default settings
# raises or finds the least force; accelerations of the loop are closed to 1e-8.
#
# Seen (pin 4.1.0): the default ProximalSettings have mu = 0 and one iteration, so there is no
# proximal term at all. With the empty row the accelerations are nan, without error or warning; a 6D
# closure of the same loop likewise. With mu = 1e-6 and ten iterations they are right to 1e-12 of
# the reference (pseudo-inverse of the same Jacobian); one iteration with mu = 1e-2 is off by 2 %,
# and says so only in settings.absolute_residual.
#
# Why it matters: hip, knee, cylinder and rod are such a loop, in every leg with a linear actuator,
# and a sagittal robot on a boom is planar as a whole. Give ProximalSettings with mu > 0 and several
# iterations, read its residual, and test results for numbers.
#
# Read: docstrings of constraintDynamics and ProximalSettings.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet pin==4.1.0 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import numpy as np
import pinocchio as pin

body = pin.Inertia(1.0, np.array([0, 0, -0.5]), 0.05 * np.eye(3))


def at(x, z):
    return pin.SE3(np.eye(3), np.array([x, 0.0, z]))


model = pin.Model()
left = model.addJoint(0, pin.JointModelRY(), at(0, 0), "left")
right = model.addJoint(0, pin.JointModelRY(), at(1, 0), "right")
across = model.addJoint(right, pin.JointModelRY(), at(0, -1), "across")
for joint in (left, right, across):
    model.appendBodyToJoint(joint, body, pin.SE3.Identity())
q, v, torques = np.array([0.2, 0.25, -0.4]), np.zeros(3), np.array([1.0, 2.0, 0.5])
settings = pin.ProximalSettings()
print("pin", pin.__version__, "default mu", settings.mu, "iterations", settings.max_iter)


def accelerations(kind, settings=None):
    """Accelerations by constraintDynamics and by a pseudo-inverse."""
    data = model.createData()
    pin.computeJointJacobians(model, data, q)
    tip = at(0, -1)
    closure = pin.RigidConstraintModel(
        kind, model, left, tip, across, data.oMi[across].inverse() * data.oMi[left] * tip, pin.LOCAL
    )
    closures, states = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
    closures.append(closure)
    states.append(closure.createData())
    pin.initConstraintDynamics(model, data, closures, states)
    more = () if settings is None else (settings,)
    found = pin.constraintDynamics(model, data, q, v, torques, closures, states, *more)
    pin.computeJointJacobians(model, data, q)
    rows = np.array(pin.getConstraintJacobian(model, data, closures[0], states[0]))
    fresh = model.createData()
    mass = pin.crba(model, fresh, q)
    inverse = np.linalg.inv(np.triu(mass) + np.triu(mass, 1).T)
    free = inverse @ (torques - pin.nonLinearEffects(model, fresh, q, v))
    force = np.linalg.lstsq(rows @ inverse @ rows.T, -rows @ free, rcond=None)[0]
    return np.array(found), free + inverse @ rows.T @ force


kinds = {"point (3D)": pin.ContactType.CONTACT_3D, "frame (6D)": pin.ContactType.CONTACT_6D}
plain = {name: accelerations(kind) for name, kind in kinds.items()}
soft = {
    name: accelerations(kind, pin.ProximalSettings(1e-12, 1e-6, 10)) for name, kind in kinds.items()
}
once = pin.ProximalSettings(1e-12, 1e-2, 1)
rough = accelerations(kinds["point (3D)"], once)
for name in kinds:
    print(f"{name}, default settings:       ", plain[name][0])
    print(f"{name}, mu 1e-6, ten iterations:", soft[name][0], "reference", soft[name][1])
print("point (3D), mu 1e-2, one iteration: ", rough[0], "residual", once.absolute_residual)

if not all(np.isnan(found).all() for found, _ in plain.values()):
    sys.exit("changed: the default settings now give numbers for a planar loop")
if max(abs(found - reference).max() for found, reference in soft.values()) > 1e-8:
    sys.exit("changed: mu = 1e-6 with ten iterations is no longer right")
if not 1e-3 < abs(rough[0] - rough[1]).max() < 1e-1:
    sys.exit("changed: one iteration with mu = 1e-2 is no longer off by per cents")
EOF
