#!/usr/bin/env bash
# A valve delay in MuJoCo shrinks with the time step, and a sensor's interval may do nothing.
#
# Guess, written before the run: an actuator's `delay` of 5 ms acts after 5 ms to one time step,
# whatever the time step; a history (`nsample`) too short for it is an error of the compiler; a
# sensor with interval 10 ms and delay is held for 10 ms.
#
# Seen (mujoco 4.0.0): the delay is cut to nsample time steps, without error or warning. A valve of
# 5 ms with nsample = 5 is right at 1 ms; at 0.5 ms it acts after 2.5 ms and at 0.1 ms after 0.5 ms.
# Delayed sensors the same. `interval` without nsample compiles and is not in force: the sensor is
# read each step; with nsample = 1 it is. A delayed sensor reads 0, not the pose at the start, until
# its history is full: a leg that starts at 0.7 rad is seen at 0 for 5 ms.
#
# Why it matters: the test of a twin is to halve its time step; here that halves the delay of its
# valves, so results converge to those of a machine without delay, and a fit of the delay to the
# twin finds the time step. Set nsample = ceil(delay / timestep) whenever the step changes, and fill
# the history after a reset (mj_initSensorHistory, mj_initCtrlHistory).
#
# Read: MuJoCo's XML reference and "Modeling", Delays (warns of delay > timestep * nsample; says
# that interval requires nsample, and that histories begin with zeros).
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


def model(timestep, valve="", gauge=""):
    loaded = mujoco.MjModel.from_xml_string(f"""<mujoco>
      <option timestep="{timestep}" gravity="0 0 0"/>
      <worldbody><body>
        <joint name="knee" type="slide" axis="1 0 0"/>
        <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
      </body></worldbody>
      <actuator><motor joint="knee" {valve}/></actuator>
      <sensor><jointpos joint="knee" {gauge}/></sensor>
    </mujoco>""")
    return loaded, mujoco.MjData(loaded)


def valve_ms(timestep, samples):
    """From the command's step at 20 ms to the first force."""
    loaded, data = model(timestep, valve=f'delay="0.005" nsample="{samples}"')
    for step in range(round(0.06 / timestep)):
        data.ctrl[0] = float(step >= round(0.02 / timestep))
        mujoco.mj_step(loaded, data)
        if data.actuator_force[0] > 0.5:
            return 1e3 * (step * timestep) - 20
    return np.inf


def gauge_ms(timestep, attributes):
    """Least and largest age of readings of a joint that moves at 1 m/s."""
    loaded, data = model(timestep, gauge=attributes)
    data.qvel[0] = 1.0
    ages = []
    for _ in range(round(0.06 / timestep)):
        before = data.time
        mujoco.mj_step(loaded, data)
        ages.append(1e3 * (before - data.sensordata[0]))
    settled = np.round(ages[len(ages) // 2 :], 3)
    return float(settled.min()), float(settled.max())


fixed = {step: valve_ms(step, 5) for step in (1e-3, 5e-4, 1e-4)}
fitting = {step: valve_ms(step, int(np.ceil(0.005 / step - 1e-9))) for step in fixed}
for step in fixed:
    print(
        f"time step {1e3 * step} ms: a valve of 5 ms acts after {fixed[step]:.2f} ms"
        f" with nsample 5, {fitting[step]:.2f} ms with nsample to fit"
    )
slow, held = gauge_ms(1e-3, 'interval="0.01"'), gauge_ms(1e-3, 'interval="0.01" nsample="1"')
late = gauge_ms(5e-4, 'delay="0.005" nsample="5"')
print("interval 10 ms, age of readings:", slow, "ms; with nsample 1:", held, "ms")
print("sensor delay 5 ms, nsample 5, step 0.5 ms, age:", late, "ms")
loaded, data = model(1e-3, gauge='delay="0.005" nsample="5"')
data.qpos[0] = 0.7
first = []
for _ in range(8):
    mujoco.mj_step(loaded, data)
    first.append(round(float(data.sensordata[0]), 3))
print("resting at 0.7, first readings:", first)

if not np.allclose([fixed[step] / 1e3 / step for step in fixed], 5, atol=1.01):
    sys.exit("changed: a delay is no longer cut to nsample time steps")
if not np.allclose(list(fitting.values()), 5, atol=0.2):
    sys.exit("changed: with a history that fits, the delay is no longer 5 ms")
if slow != (0.0, 0.0) or held[1] < 8:
    sys.exit("changed: interval without nsample is now in force, or with it no longer")
if late[1] > 3 or first[0] != 0.0 or first[-1] != 0.7:
    sys.exit("changed: delayed sensors keep their delay, or begin with the pose at the start")
EOF
