#!/usr/bin/env bash
# A sagittal robot in URDF has no weight in Pinocchio: the axis of a planar joint is not read.
#
# Guess, written before the run: a base with <joint type="planar"> and axis y moves in the plane
# perpendicular to that axis in Pinocchio and in MuJoCo, as URDF says; the generalised force of
# gravity on its vertical slide is the robot's weight.
#
# Seen (pin 4.1.0, mujoco 4.0.0; pin 2.7.0 alike): MuJoCo takes the axis. Pinocchio moves the base
# in x and y and turns it about z whatever the axis says, without a warning. Of 11 kg gravity puts
# 0 N on the base instead of 107.9 N; let go it stays in the air; a vertical ground force on the
# trunk does nothing. Gravity's torque at the hip is right all the same. MuJoCo's second slide
# points down where the axis is y, so equal vectors q would not mean the same pose even then. With
# axis z in an origin turned by 90 degrees about x, and a fixed joint that turns back, both have the
# weight, z is up and pitch is about -y. Velocities still differ, Pinocchio's are in the trunk's
# frame: pitched by 0.5 rad and let go, the base accelerates by (-4.70, -8.61) m/s2 there and by
# (0, -9.81) in MuJoCo, which is the same fall.
#
# Why it matters: a robot on a boom is planar, and MuJoCo refuses massless links between slides, so
# the planar joint is what one file for both can have. A plan, an LQR or a fit of masses with this
# base is of a robot that slides on a table. Check that gravity's generalised force is the weight,
# and turn velocities by the pitch.
#
# Read: URDF's page of joints (planar: a plane perpendicular to the axis; axis: its surface normal);
# Drake's issue 19314 (the same in another library, open); docstrings of buildModelFromUrdf and
# JointModelPlanar (nothing on the axis).
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet pin==4.1.0 mujoco==4.0.0 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import mujoco
import numpy as np
import pinocchio as pin

np.set_printoptions(precision=3, suppress=True)
link = (
    '<link name="{0}"><inertial><origin xyz="{1}"/><mass value="{2}"/>'
    '<inertia ixx="{3}" iyy="{3}" izz="{3}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)
sagittal = (
    '<joint name="base" type="planar"><parent link="world"/><child link="trunk"/>'
    '<axis xyz="0 1 0"/></joint>'
)
turned = (
    '<link name="plane"/><joint name="base" type="planar"><parent link="world"/>'
    '<child link="plane"/><origin rpy="1.5707963267948966 0 0"/><axis xyz="0 0 1"/></joint>'
    '<joint name="back" type="fixed"><parent link="plane"/><child link="trunk"/>'
    '<origin rpy="-1.5707963267948966 0 0"/></joint>'
)
weight = 11 * 9.81
print("pin", pin.__version__, "mujoco", mujoco.__version__, f"weight {weight:.2f} N")


def robot(base):
    return (
        '<robot name="robot"><link name="world"/>'
        + link.format("trunk", "0 0 0.1", 8, 0.2)
        + link.format("leg", "0 0 -0.15", 3, 0.03)
        + base
        + '<joint name="hip" type="revolute"><parent link="trunk"/><child link="leg"/>'
        '<axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="50" velocity="20"/></joint></robot>'
    )


def in_pinocchio(base, pitch=0.0, hip=0.0):
    """Gravity's generalised force, the slides' directions, acceleration when let go."""
    model = pin.buildModelFromXML(robot(base))
    data = model.createData()
    q = np.array([0, 0, np.cos(pitch), np.sin(pitch), hip])
    gravity = pin.computeGeneralizedGravity(model, data, q).copy()
    frame = model.getFrameId("trunk")
    moves = pin.computeFrameJacobian(model, data, q, frame, pin.LOCAL_WORLD_ALIGNED)[:3, :2].T
    return gravity, moves.copy(), pin.aba(model, data, q, np.zeros(4), np.zeros(4)).copy()


def in_mujoco(base, pitch=0.0, hip=0.0):
    model = mujoco.MjModel.from_xml_string(robot(base))
    data = mujoco.MjData(model)
    data.qpos[2:] = pitch, hip
    mujoco.mj_forward(model, data)
    moves = np.zeros((3, 4))
    mujoco.mj_jacBody(model, data, moves, None, 1)
    return data.qfrc_bias.copy(), moves[:, :2].T.copy(), data.qacc.copy()


seen = {
    (kind, name): tool(base)
    for kind, base in (("axis y", sagittal), ("turned", turned))
    for name, tool in (("pinocchio", in_pinocchio), ("mujoco", in_mujoco))
}
for (kind, name), (gravity, moves, fall) in seen.items():
    print(f"{kind}, {name:9s}: gravity on the base {gravity[:2]} N, let go {fall[:2]} m/s2,")
    print(f"                   slides along {moves[0]} and {moves[1]}")
hips = [tool(sagittal, hip=0.5)[0][3] for tool in (in_pinocchio, in_mujoco)]
print(f"axis y, gravity at a hip of 0.5 rad: {hips[0]:.3f} and {hips[1]:.3f} N.m")
pitched = [tool(turned, pitch=0.5)[2][:2] for tool in (in_pinocchio, in_mujoco)]
print("turned, pitched by 0.5 rad, let go:", *pitched, "m/s2")

gravity, moves, fall = seen["axis y", "pinocchio"]
if max(np.abs(part).max() for part in (gravity[:2], fall[:2], moves[:, 2])) > 1e-9:
    sys.exit("changed: Pinocchio now reads the axis of a planar joint")
if not np.allclose(seen["axis y", "mujoco"][0][:2], [0, -weight]):
    sys.exit("changed: MuJoCo no longer has the weight on a slide that points down")
if not np.isclose(*hips):
    sys.exit("changed: gravity's torque at the hip now differs")
for name in ("pinocchio", "mujoco"):
    if not np.allclose(seen["turned", name][0][:2], [0, weight], atol=1e-6):
        sys.exit(f"changed: with a turned origin {name} no longer has the weight on the base")
expected = [-9.81 * np.array([np.sin(0.5), np.cos(0.5)]), [0, -9.81]]
if not np.allclose(pitched, expected, atol=1e-6):
    sys.exit("changed: velocities are no longer in the trunk's frame here and the world's there")
EOF
