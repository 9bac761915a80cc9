#!/usr/bin/env bash
# MuJoCo's new `discrete` integrator brakes every spring: it adds a damper of step times
# stiffness.
#
# Guess, written before the run: `discrete` is the stable one for stiff springs, and on a soft
# one, far below its limit, agrees with the others to a percent.
#
# Seen (mujoco 4.0.0, which has it since 3.13): a leg of 1 kg on 900 N/m without friction, 4.8
# swings in a second, keeps 101 % of its energy by Euler and implicitfast, 100 % by RK4, and 17 %
# by `discrete` with the default step of 2 ms; 64 % with 0.5 ms. What is lost is that of a damper
# of step times stiffness, 1.8 N.s/m here, to 1 %. A position servo of the same gain loses as
# much.
#
# Why it matters: legs on air or steel springs, and hops that live on them, die out within a few
# strides; a fit of the joint's damping to such a twin finds the time step. Subtract step times
# stiffness from the damping that the model is given, or keep an explicit integrator where springs
# store what a motion needs.
#
# Read: MuJoCo's changelog (3.13.0: springs and position gains join the solver's metric, stable
# beyond the explicit limit; nothing on what they lose).
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet mujoco==4.0.0 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import mujoco
import numpy as np

STIFFNESS, START = 900.0, 0.05  # N/m, m; 1 kg
LEG = """<mujoco><option integrator="{integrator}" timestep="{step}" gravity="0 0 0"/>
<worldbody><body><joint name="knee" type="slide" axis="0 0 1" {spring}/>
<geom size="0.05" mass="1"/></body></worldbody>{servo}</mujoco>"""
SPRING = {"spring": f'stiffness="{STIFFNESS}"', "servo": ""}
SERVO = {
    "spring": "",
    "servo": f'<actuator><position joint="knee" kp="{STIFFNESS}"/></actuator>',
}
print("mujoco", mujoco.__version__)


def left(integrator, step, parts):
    """Share of the energy after one second."""
    text = LEG.format(integrator=integrator, step=step, **parts)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos[0] = START
    for _ in range(round(1.0 / step)):
        mujoco.mj_step(model, data)
    energy = data.qvel[0] ** 2 + STIFFNESS * data.qpos[0] ** 2
    return float(energy / (STIFFNESS * START**2))


seen = {}
for integrator in ("Euler", "implicitfast", "RK4", "discrete"):
    for step in (0.002, 0.0005):
        seen[integrator, step] = left(integrator, step, SPRING)
        line = f"{integrator:13s} {1e3 * step:.1f} ms: {seen[integrator, step]:.3f} of the energy"
        damper = -np.log(seen[integrator, step])
        print(f"{line}, as by a damper of {damper:+.3f} N.s/m; step x k {step * STIFFNESS:.2f}")
servo = left("discrete", 0.002, SERVO)
print(f"position servo, discrete, 2 ms: {servo:.3f}")

if any(abs(share - 1) > 0.02 for (name, _), share in seen.items() if name != "discrete"):
    sys.exit("changed: the other integrators kept the energy to 2 %")
for step in (0.002, 0.0005):
    damper = -np.log(seen["discrete", step])
    if abs(damper / (step * STIFFNESS) - 1) > 0.05:
        sys.exit("changed: discrete no longer takes what a damper of step times stiffness takes")
if abs(servo - seen["discrete", 0.002]) > 0.01:
    sys.exit("changed: a position servo no longer loses as much as a spring")
EOF
