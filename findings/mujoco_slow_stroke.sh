#!/usr/bin/env bash
# MuJoCo's frictionloss in a slow stroke: half the friction that the file says, growing with speed.
#
# Guess, written before the run: below its limit, friction loss holds a joint but for a creep under
# 0.1 mm/s.
#
# Seen (mujoco 4.0.0; 3.2.6 alike), 1 kg, frictionloss 20 N: pushed by 5, 10 and 19 N it creeps at
# 5, 11 and 20 mm/s; driven at 2, 5, 10 and 15 mm/s it resists with 1.9, 4.7, 9.5 and 14.2 N, and
# with 20 N only beyond 21 mm/s. Up to there it is a damper of about 950 N.s/m per kg: the knee is
# at 1.06e-3 s times force / mass, 0.1 m/s for a 0.2 kg rod. With noslip_iterations it holds still
# and resists with 20 N at every speed.
#
# Why it matters: seals are measured in strokes of about 10 mm/s, there and back; half the
# difference of force is read as Coulomb friction. On a MuJoCo twin that reading finds viscous
# damping instead, at any time step, and a tool that is judged by such a twin is marked wrong for
# the right answer. For dry friction at low speed use noslip_iterations, or a first solimpfriction
# close to 1.
#
# Read: MuJoCo's documentation, "Modeling" (solver parameters of friction; slow slippage, told of
# contacts, without figures), XML reference (joint/frictionloss; noslip_iterations, off by default).
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet mujoco==4.0.0 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import mujoco
import numpy as np

print("mujoco", mujoco.__version__)
loss = 20.0


def stroke(*, push=None, speed=None, noslip=0, timestep=0.0005):
    """Final speed in mm/s under a constant push, or the drive's force in N at a constant speed."""
    model = mujoco.MjModel.from_xml_string(f"""<mujoco>
      <option timestep="{timestep}" gravity="0 0 0" noslip_iterations="{noslip}"/>
      <worldbody><body>
        <joint name="rod" type="slide" axis="1 0 0" frictionloss="{loss}"/>
        <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
      </body></worldbody>
      <actuator><velocity joint="rod" kv="{2000 if speed else 0}"/></actuator>
    </mujoco>""")
    data = mujoco.MjData(model)
    data.qfrc_applied[0] = push or 0
    # The drive's set speed is raised until the rod moves at the speed that is asked for.
    data.ctrl[0] = speed or 0
    for _ in range(int(2 / timestep)):
        mujoco.mj_step(model, data)
        if speed:
            data.ctrl[0] += 0.01 * (speed - data.qvel[0])
    return data.qfrc_actuator[0] if speed else 1e3 * data.qvel[0]


pushes, speeds = (5, 10, 19), (0.002, 0.005, 0.010, 0.015, 0.050)
creep = [stroke(push=push) for push in pushes]
drag = [stroke(speed=speed) for speed in speeds]
fine = [stroke(speed=speed, timestep=0.0001) for speed in speeds]
firm = [stroke(speed=speed, noslip=20) for speed in speeds]
for push, speed in zip(pushes, creep, strict=True):
    print(
        f"pushed by {push:2d} N of {loss:.0f} N: creeps at {speed:5.2f} mm/s;"
        f" with noslip {stroke(push=push, noslip=20):.4f} mm/s"
    )
for row in zip(speeds, drag, fine, firm, strict=True):
    print(
        "driven at {:4.0f} mm/s: {:5.2f} N; time step 0.1 ms: {:5.2f} N; noslip: {:5.2f} N".format(
            1e3 * row[0], *row[1:]
        )
    )

if not np.allclose(creep, 1.0556 * np.array(pushes), rtol=0.02):
    sys.exit("changed: the creep below the limit is another")
if not np.allclose(drag[:4], 947 * np.array(speeds[:4]), rtol=0.05) or abs(drag[4] - loss) > 0.5:
    sys.exit("changed: friction loss in slow strokes is no longer in proportion to speed")
if not np.allclose(fine, drag, rtol=0.05):
    sys.exit("changed: a smaller time step now changes it")
if not np.allclose(firm, loss, rtol=0.05):
    sys.exit("changed: with noslip_iterations the whole friction loss no longer resists")
EOF
