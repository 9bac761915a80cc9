#!/usr/bin/env bash
# MuJoCo's end stops: 300 N push a piston 30 mm through; armature counts if the axis is tilted.
#
# Guess, written before the run: a piston of 0.2 kg that 300 N press on its joint limit goes less
# than 1 mm beyond it; an axis tilted by 0.001 rad has the same stop and the same effect of
# armature, within 1 %.
#
# Seen (mujoco 4.0.0; 3.2.6 alike): with default solreflimit the piston comes to rest at 2e-5 s2
# times force / mass beyond its stop: 30 mm at 0.2 kg, 120 mm at 0.05 kg, 6 mm at 1 kg. A constraint
# is a spring of given *time constant*, so its stiffness is in proportion to the inertia that it
# reckons with (1 / dof_invweight0), and a light rod has a weak stop. One kilogram of armature
# should make that 5 mm. It stays 30 mm where a body of the world without children slides along its
# own axis with its centre of mass at its origin: for such "simple" bodies the weight is 1 / mass,
# without armature. Tilt the axis by 0.001 rad, or write simple="false", and it is 5 mm; the
# reference calls that attribute an optimisation of memory and computation. `connect` closes loops
# by the same rule: 60 mm of gap at 300 N on a part of 0.1 kg.
#
# Why it matters: pneumatic cylinders end on their stops, and rods are light. In a twin on MuJoCo
# the stop's give moves the end of the stroke, the chamber's volume and the time of the impact, and
# a change of drawing that tilts an axis changes them sixfold. Set solreflimit as a stiffness and a
# damping (two negative numbers; still per unit of inertia) from the stop's data, and check the rest
# position against force / stiffness.
#
# Read: MuJoCo's documentation, "Modeling", solver parameters (mass-independent by design), XML
# reference (joint/armature, body/simple: 4.0).
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet mujoco==4.0.0 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import mujoco

print("mujoco", mujoco.__version__)
force = 300.0


def simulated(xml, push):
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="0.0005" gravity="0 0 0"/>{xml}</mujoco>'
    )
    data = mujoco.MjData(model)
    data.qfrc_applied[push] = force
    for _ in range(8000):
        mujoco.mj_step(model, data)
    return model, data


def beyond_stop(mass, armature=0.0, axis="1 0 0", simple="auto"):
    """Millimetres beyond the stop after 4 s, and 1 / the inertia that it reckons with."""
    model, data = simulated(
        f"""<worldbody><body simple="{simple}">
          <joint type="slide" axis="{axis}" range="0 0.1" armature="{armature}"/>
          <inertial pos="0 0 0" mass="{mass}" diaginertia="0.01 0.01 0.01"/>
        </body></worldbody>""",
        0,
    )
    return 1e3 * (data.qpos[0] - 0.1), model.dof_invweight0[0]


def gap(mass):
    """Millimetres of gap of a `connect` that holds a free body against the force."""
    _, data = simulated(
        f"""<worldbody><body name="part"><freejoint/>
          <inertial pos="0 0 0" mass="{mass}" diaginertia="0.01 0.01 0.01"/>
        </body></worldbody><equality><connect body1="part" anchor="0 0 0"/></equality>""",
        0,
    )
    return 1e3 * data.qpos[0]


light, piston, heavy = (beyond_stop(mass) for mass in (0.05, 0.2, 1.0))
straight, tilted = beyond_stop(0.2, 1.0), beyond_stop(0.2, 1.0, "1 0.001 0")
general = beyond_stop(0.2, 1.0, simple="false")
loop = gap(0.1)
for name, seen in (
    ("0.05 kg", light),
    ("0.2 kg", piston),
    ("1 kg", heavy),
    ("0.2 kg, armature 1 kg", straight),
    ("the same, axis tilted 1 mrad", tilted),
    ('the same, simple="false"', general),
):
    print(f"{name:30s} {seen[0]:7.2f} mm beyond at {force:.0f} N, invweight0 {seen[1]:.4f} 1/kg")
print(f"connect, part of 0.1 kg        {loop:7.2f} mm of gap")

if not all(
    abs(seen[0] - 2e-2 * force / mass) < 0.2
    for seen, mass in ((light, 0.05), (piston, 0.2), (heavy, 1.0))
):
    sys.exit("changed: the stop no longer gives by 2e-5 s2 times force / mass")
if abs(straight[0] - piston[0]) > 0.1 or max(tilted[0], general[0]) > 6:
    sys.exit("changed: armature now counts for a simple body's stop, or no longer for another's")
if loop < 50:
    sys.exit("changed: a connect no longer opens by centimetres")
EOF
