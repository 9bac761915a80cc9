#!/usr/bin/env bash
# One cylinder drawn in four ways in MuJoCo: a load cell reads 500 N or nothing.
#
# Guess, written before the run: a load cell (`force` on a welded body) that carries a cylinder's
# lug reads the 500 N of the cylinder, whether this is a spatial tendon, a site with refsite, a
# slider-crank, or a rod of its own that a `connect` closes.
#
# Seen (mujoco 4.0.0): all four press a lever on its stop with the same moment, 50 N.m, and the same
# 166.7 N. As tendon or as rod, cells at the lug and at the rod's end read 500 N and the lever's
# bearing 333 N. As site or slider-crank both cells read 0 and the bearing 167 N the other way: such
# forces act on the coordinates alone and are left out of the wrenches between bodies. Up to 3.13
# tendons were left out as well (3.2.6 and 3.9.0: 0 N), so an upgrade changes logs of one file.
#
# Why it matters: a piston's area and friction are fitted to the force of a load cell over pressure,
# and a knee's friction and size go by the load of its bearing. On a twin whose cylinder is drawn as
# slider-crank, MuJoCo's own element for this linkage, the fit finds no area at all, and the piston
# seems to relieve the bearing that it loads. Where forces are read, draw cylinders as tendons or
# as rods.
#
# Read: MuJoCo's XML reference (sensor/force: "all forces acting on the system"; cranksite),
# changelog of 3.14.0 (tendons are now counted), its issue 832.
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
part = '<inertial pos="{} 0 0" mass="{}" diaginertia="1e-4 1e-4 1e-4"/>'
rod = (
    '<body name="rod" pos="0 0 -0.2"><joint type="hinge" axis="0 1 0" pos="0 0 0.2"/>'
    f'<joint name="stroke" type="slide" axis="0 0 -1"/>{part.format(0, 0.1)}'
    '<site name="tip" pos="0 0 -0.1"/></body>'
)
tendon = '<tendon><spatial name="path"><site site="lug"/><site site="end"/></spatial></tendon>'
closure = '<equality><connect site1="tip" site2="end"/></equality>'
ways = {
    "tendon": ('tendon="path" gear="500"', tendon, ""),
    "rod": ('joint="stroke" gear="500"', closure, rod),
    "site": ('site="end" refsite="lug" gear="0 0 500 0 0 0"', "", ""),
    "slider-crank": ('cranksite="end" slidersite="lug" cranklength="0.3" gear="500"', "", ""),
}


def pressed(motor, more, inside):
    """A lever pressed on its stop by 500 N: the stop's force and the vertical readings."""
    model = mujoco.MjModel.from_xml_string(f"""<mujoco>
      <option timestep="0.0005" gravity="0 0 0"/>
      <worldbody>
        <body name="cell" pos="0.1 0 0.3">
          {part.format(0, 0.01)}<site name="lug" zaxis="0 0 -1"/>{inside}
        </body>
        <body name="lever">
          <joint type="hinge" axis="0 1 0"/>{part.format(0.2, 1)}
          <site name="bearing"/><geom type="sphere" size="0.02" pos="0.3 0 0" mass="0"/>
          <body name="end_cell" pos="0.1 0 0">{part.format(0, 0.01)}<site name="end"/></body>
        </body>
        <geom type="box" size="0.05 0.05 0.02" pos="0.3 0 -0.0395" solref="-200000 -500"/>
      </worldbody>
      {more}
      <actuator><motor {motor}/></actuator>
      <sensor><force site="lug"/><force site="end"/><force site="bearing"/></sensor>
    </mujoco>""")
    data = mujoco.MjData(model)
    data.ctrl[0] = 1.0
    stop = np.zeros(6)
    for _ in range(6000):
        mujoco.mj_step(model, data)
    mujoco.mj_contactForce(model, data, 0, stop)
    lug, end, bearing = data.sensordata.reshape(3, 3)[:, 2]
    return np.array([stop[0], lug, end, bearing])


read = {name: pressed(*way) for name, way in ways.items()}
for name, (stop, lug, end, bearing) in read.items():
    print(
        f"{name:12s} stop {stop:6.1f} N; cells: lug {lug:6.1f} N, rod's end {end:6.1f} N;"
        f" bearing {bearing:7.1f} N"
    )

whole, lacking = [500 / 3, 500, 500, 1000 / 3], [500 / 3, 0, 0, -500 / 3]
if not all(np.allclose(read[name], whole, atol=1) for name in ("tendon", "rod")):
    sys.exit("changed: a tendon's or a rod's force is no longer in the load cells")
if not all(np.allclose(read[name], lacking, atol=1) for name in ("site", "slider-crank")):
    sys.exit("changed: forces of sites or slider-cranks are now in the load cells")
EOF
