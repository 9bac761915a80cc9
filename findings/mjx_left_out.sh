#!/usr/bin/env bash
# MJX: rotors lose their inertia, valves their delay and cushions their spring, without a word.
#
# Guess, written before the run: what `mjx.put_model` takes it simulates as MuJoCo does. What it
# cannot it refuses; the documentation says so, and so it is with the integrator `discrete`, DC
# motors and slider-cranks.
#
# Seen (mujoco-mjx 3.17.0 in JAX, jax 0.10.2, with mujoco 3.17.0 and 4.0.0; not tried in Warp): a
# leg of two links, a step of the motor, gear 9, at its knee. After 0.1 s the knee is at 90.5
# degrees in MJX, whichever of these is in the file:
# - `armature` of the motor, the rotor's inertia: 36.4 degrees in MuJoCo.
# - `damping` of the motor: 43.3 degrees.
# - `delay` of the motor, 30 ms: 54.0 degrees.
# - `actuatorgroupdisable` of its group: 0, the motor is off.
# - a cushion with stiffness="0 0 100" (Nm/rad^3): 8.6 degrees, on its way back. Of polynomials MJX
#   reads the first coefficient: with damping="0.1 0.1" 73.9 degrees and not 30.9.
# `actearly` is left out as well. The rotor's inertia written as the joint's armature, gear^2 times
# as large, agrees.
#
# Why it matters: policies are trained in MJX and tried in MuJoCo. Legs that swing three times as
# far, valves without delay and stops without a cushion are learned, and what fails afterwards is
# laid to the transfer. Write inertia and damping of rotors into joints, times gear^2; add delays
# and polynomials by hand; compare one motion in both before training.
#
# Read: MuJoCo's documentation of MJX (feature parity) and of actuators and joints in MJCF.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet --no-compile mujoco-mjx==3.17.0 mujoco==3.17.0 \
    jax==0.10.2 jaxlib==0.10.2 numpy==2.4.6
JAX_PLATFORMS=cpu XLA_FLAGS=--xla_backend_optimization_level=0 "$work/venv/bin/python" - <<'EOF'
import sys
import warnings
from importlib.metadata import version

import jax
import mujoco
import numpy as np
from mujoco import mjx

jax.config.update("jax_enable_x64", True)
warnings.simplefilter("error")  # none is given
print("mujoco-mjx", version("mujoco-mjx"), "jax", jax.__version__, "mujoco", mujoco.__version__)
LEG = """<mujoco><option timestep="0.002" {option}>
<flag contact="disable"/></option><worldbody>
<body><joint name="hip" axis="0 1 0"/><geom type="capsule" size="0.04" fromto="0 0 0 0 0 -0.3"/>
<body pos="0 0 -0.3"><joint name="knee" axis="0 1 0" {joint}/>
<geom type="capsule" size="0.03" fromto="0 0 0 0 0 -0.3"/></body></body></worldbody>
<actuator><motor joint="knee" gear="9" group="1" {motor}/></actuator></mujoco>"""
step = jax.jit(mjx.step)


def knee(joint="", motor="", option=""):
    """Angle of the knee in degrees after 0.1 s, in MuJoCo and in MJX."""
    text = LEG.format(joint=joint, motor=motor, option=option)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    theirs = mjx.put_model(model)
    state = mjx.put_data(model, data).replace(ctrl=jax.numpy.array([0.5]))
    data.ctrl[:] = 0.5
    for _ in range(50):
        mujoco.mj_step(model, data)
        state = step(theirs, state)
    return tuple(float(np.degrees(qpos[1])) for qpos in (data.qpos, state.qpos))


def refuses(text):
    try:
        mjx.put_model(mujoco.MjModel.from_xml_string(text))
    except NotImplementedError:
        return True
    return False


cases = {
    "no more than the leg": {},
    "armature of the joint": {"joint": 'armature="0.0243"'},
    "armature of the motor": {"motor": 'armature="0.0003"'},
    "damping of the motor": {"motor": 'damping="0.005"'},
    "delay of 30 ms": {"motor": 'delay="0.03" nsample="20"'},
    "motor disabled": {"option": 'actuatorgroupdisable="1"'},
    "stiffness 0 0 100": {"joint": 'stiffness="0 0 100"'},
    "damping 0.1 0.1": {"joint": 'damping="0.1 0.1"'},
}
seen = {}
for words, options in cases.items():
    seen[words] = knee(**options)
    print("{:22s} MuJoCo {:6.2f}, MJX {:6.2f} degrees".format(words, *seen[words]))

if not refuses(LEG.format(joint="", motor="", option='integrator="implicit"')):
    sys.exit("changed: MJX no longer refuses what it cannot do")
for words in ("no more than the leg", "armature of the joint"):
    if abs(np.subtract(*seen[words])) > 1e-6:  # degrees
        sys.exit(f"changed: MuJoCo and MJX no longer agree, {words}")
if abs(seen["armature of the joint"][0] - seen["armature of the motor"][0]) > 0.01:
    sys.exit("changed: MuJoCo's armature of a motor")
left_out = list(seen.values())[2:7]
same = [theirs for _, theirs in left_out]
if not np.allclose(same, seen["no more than the leg"][1], atol=1e-6):
    sys.exit("changed: MJX reads one of those that it left out")
if not np.allclose([ours for ours, _ in left_out], [36.4, 43.3, 54.0, 0, 8.6], atol=0.1):
    sys.exit("changed: MuJoCo's angles")
if not np.allclose(seen["damping 0.1 0.1"], [30.9, 73.9], atol=0.1):
    sys.exit("changed: polynomial damping")
EOF
